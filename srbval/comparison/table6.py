"""Table 6 of the paper, compared with our model at the paper's speed and at the measured speeds of the rig."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from srbval.bearing import RACE_DEFECTS, Fault
from srbval.comparison.compared_quantities import RACE_LINE
from srbval.comparison.comparison import RIG_READING, RIG_SPEED, QuantityValue, Row, comparison_row, deviation_pct
from srbval.errors import DataError
from srbval.models.run import Run
from srbval.reading.analyse import Analysis
from srbval.recordings.datasets.description import PublishedSpeeds, dataset
from srbval.storage.installation import shipped_folder
from srbval.storage.tables import build, read_toml

CASES_FOLDER, PAPER_CASE = "data_manifest/cases", "torino-22240"  # folder of the bundled cases; case of the paper
PRINTED = ("model_hz", "rig_hz", "model_printed_pct", "rig_printed_pct")  # the paper's columns, repeated in rows


@dataclass(frozen=True, kw_only=True)
class Published:
    """Published frequencies of a fault line [Hz]; ``*_printed_pct``: published deviations from `kinematic_hz`."""

    state: Fault
    rpm: float
    motor_rpm: float | None = None
    radial_kn: float | None = None
    kinematic_hz: float | None = None
    model_hz: float | None = None
    model_printed_pct: float | None = None
    rig_hz: float | None = None
    rig_printed_pct: float | None = None
    source: str = ""

    def deviations_pct(self) -> dict[str, float]:
        """Deviations of the known frequencies `model_hz` and `rig_hz` from the kinematic frequency [%], by name."""
        kinematic_hz, found = self.kinematic_hz, {"model_hz": self.model_hz, "rig_hz": self.rig_hz}
        return {name: deviation_pct(hz, kinematic_hz) for name, hz in found.items() if hz is not None and kinematic_hz}


def table6() -> dict[Fault, Published]:
    """Rows of the paper's Table 6 by defect, from the bundled case of the paper."""
    case = read_toml(shipped_folder(CASES_FOLDER) / f"{PAPER_CASE}.toml")
    rows = [build(Published, row, PAPER_CASE) for row in case["published"]]
    return {row.state: row for row in rows}


def published_speeds() -> PublishedSpeeds:
    """Mean shaft speeds from the tachometer, as published with the rig's open recordings."""
    speeds = dataset("torino-excerpts").published_speeds
    assert speeds is not None, "a test holds the description to its speeds"
    return speeds


def published_rows(
    printed: Mapping[Fault, Published], paper: Mapping[Fault, Analysis], runs: Mapping[str, Run]
) -> Iterator[Row]:
    """Compare our `runs` at the paper's speed, analysed in `paper`, with the `printed` Table 6 for each race defect.

    The paper states no uncertainty and no measured speed for its rig values, so the verdict is ``insufficient data``.
    Raises `DataError` if a line cannot be read because its run is too short.
    """
    for fault in RACE_DEFECTS:
        row, line = printed[fault], paper[fault].line_of(fault)
        assert row.rig_hz is not None, "Table 6 states every value"
        if line.found_hz is None:
            raise DataError(f"{line.name} cannot be read; the run of {paper[fault].recording.name} is too short.")
        made = comparison_row(
            model=QuantityValue(value=line.found_hz, ci95=line.ci95_hz or 0.0),
            rig=QuantityValue(value=row.rig_hz, ci95=None, kinematic=row.kinematic_hz),
            error=deviation_pct(line.found_hz, row.rig_hz),
            parts={},
        )
        about = {"rig_source": "published", "shaft_rpm": row.rpm}
        about |= {f"paper_{name}": getattr(row, name) for name in PRINTED}
        about |= {f"paper_{name[:-3]}_recomputed_pct": pct for name, pct in row.deviations_pct().items()}
        yield _build_line_row(fault, made, 1.0, runs[f"paper-{fault}"]) | about


def measured_rows(comparisons: Iterable[Row], runs: Mapping[Fault, Run]) -> Iterator[Row]:
    """Compare our model with each recording at its measured speed; a state without a detected line gets no row.

    `comparisons` are the rows of a validation for one recording per state, `runs` its runs at the recordings' speeds.
    """
    lines = {row["state"]: row for row in comparisons if row["kind"] == RACE_LINE.kind and row["rig_present"]}
    for fault in (fault for fault in RACE_DEFECTS if fault in lines):
        shaft_hz = lines[fault]["speeds_hz"][1]
        about = {"rig_source": "measured", "shaft_rpm": 60 * shaft_hz, "rig_shaft_rpm": 60 * shaft_hz}
        yield _build_line_row(fault, lines[fault], shaft_hz, runs[fault]) | about


def _build_line_row(fault: Fault, made: Row, unit_hz: float, run: Run) -> Row:
    """Build the table row of a fault line from the comparison `made` of its frequency in units of `unit_hz`.

    The row also contains the frequency from the cage speed of `run`.
    """
    return {
        "defect": fault,
        "line": fault.line,
        "kinematic_hz": unit_hz * made["kinematic"],
        "model_hz": unit_hz * made["model"],
        "model_ci95_hz": unit_hz * made["model_ci95"],
        "model_deviation_pct": deviation_pct(made["model"], made["kinematic"]),
        "rig_hz": unit_hz * made["rig"],
        "rig_ci95_hz": made["rig_ci95"] and unit_hz * made["rig_ci95"],
        "rig_shaft_rpm": None,
        "rig_deviation_pct": deviation_pct(made["rig"], made["kinematic"]),
        "comparison_error_pct": made["error"],
        "validation_uncertainty_pct": made["uncertainty"],
        "uncertainty_parts_pct": made["parts"],
        "verdict": made["verdict"],
        "model_cage_hz": run.bpfo_hz if fault is Fault.OUTER else run.bpfi_hz,
    }


def check_race_sum(
    source: str,
    origin: str,
    rolling_elements: int,
    orders: Sequence[float],
    ci95: float | None,
    rpm: float,
    slip: float = 0.0,
) -> Row:
    """Check the sum rule: BPFO + BPFI in orders of the shaft equals the number of rolling elements.

    `orders` are BPFO and BPFI at the shaft speed `rpm`, from signals with an outer-race and an inner-race fault; `ci95`
    is the 95 % half width of their sum, `slip` the part of the sum due to different slip in the two signals. `closed`
    is true if the sum without this part equals the number of rolling elements within `ci95`, and None if `ci95` is
    None. `implied_rpm` is the shaft speed at which the rule is exact.
    """
    bpfo, bpfi = orders
    total = bpfo + bpfi
    return {
        "source": source,
        "origin": origin,
        "rolling_elements": rolling_elements,
        "bpfo_order": bpfo,
        "bpfi_order": bpfi,
        "ci95": ci95,
        "stated_rpm": rpm,
        "slip_difference": slip,
        "total": total,
        "difference_pct": 100 * (total / rolling_elements - 1),
        "implied_rpm": rpm * total / rolling_elements,
        "closed": None if ci95 is None else bool(abs(total - slip - rolling_elements) <= ci95),
    }


def check_table6_sums(published: Sequence[Row], measured: Sequence[Row], rolling_elements: int) -> Iterator[Row]:
    """Check that BPFO + BPFI orders equal the number of rollers, for Table 6, our model and the rig's recordings.

    For `published` and `measured` see `published_rows` and `measured_rows`.
    """
    rpm, columns = published[0]["shaft_rpm"], ("kinematic_hz", "paper_model_hz", "paper_rig_hz")
    for source, column in zip(("kinematic, as printed", "paper's model", "paper's rig"), columns, strict=True):
        yield check_race_sum(source, "published", rolling_elements, _orders(published, column), None, rpm)
    orders, ci95 = _orders(published, "model_hz"), math.hypot(*_orders(published, "model_ci95_hz"))
    slip = sum(_orders(published, "model_cage_hz")) - rolling_elements
    yield check_race_sum("our model, two runs", "simulated", rolling_elements, orders, ci95, rpm, slip)
    if len(measured) == len(RACE_DEFECTS):
        orders, rpm = _orders(measured, "rig_hz"), sum(row["shaft_rpm"] for row in measured) / len(measured)
        shares = ([row["uncertainty_parts_pct"][part] / 100 for part in (RIG_READING, RIG_SPEED)] for row in measured)
        ci95 = math.hypot(*(order * math.hypot(*of_line) for order, of_line in zip(orders, shares, strict=True)))
        yield check_race_sum("rig recordings", "measured", rolling_elements, orders, ci95, rpm)


def _orders(rows: Iterable[Row], column: str) -> list[float]:
    return [60 * row[column] / row["shaft_rpm"] for row in rows]
