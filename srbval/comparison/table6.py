"""Table 6 of the paper, compared with our model at the paper's speed and at the measured speeds of the rig."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from srbval.bearing import RACE_DEFECTS, Fault
from srbval.comparison.compared_quantities import CAGE_RATIO
from srbval.comparison.comparison import QuantityValue, Row, comparison_row, deviation_pct
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
    """
    for fault in RACE_DEFECTS:
        row, model = printed[fault], read_first_harmonic(paper[fault], fault)
        assert row.rig_hz is not None, "Table 6 states every value"
        rig = QuantityValue(value=row.rig_hz, ci95=None, kinematic=row.kinematic_hz)
        about = {"rig_source": "published", "shaft_rpm": row.rpm}
        about |= {f"paper_{name}": getattr(row, name) for name in PRINTED}
        about |= {f"paper_{name[:-3]}_recomputed_pct": pct for name, pct in row.deviations_pct().items()}
        yield _build_line_row(fault, model, rig, runs[f"paper-{fault}"], {}) | about


def measured_rows(rig: Mapping[Fault, Analysis], runs: Mapping[Fault, Run], comparisons: pd.DataFrame) -> Iterator[Row]:
    """Compare our model with each recording at its measured speed; a state without a detected line gets no row.

    An error of 1 % of the cage ratio c is an error of 1 % of BPFO and of c / (1 - c) % of BPFI.
    """
    of_cage = comparisons[comparisons["kind"] == CAGE_RATIO.kind].drop_duplicates("state").set_index("state")
    for fault in (fault for fault in RACE_DEFECTS if fault in rig and fault in of_cage.index):
        measured, speed = read_first_harmonic(rig[fault], fault), rig[fault].speed
        c = float(of_cage.at[fault, "model"])
        passing = c if fault is Fault.OUTER else 1 - c  # speed of the rollers past the race, over the shaft speed
        model = QuantityValue(value=rig[fault].bearing.rolling_elements * speed.value_hz * passing)
        parts = {name: c / passing * part for name, part in of_cage.at[fault, "parts"].items()}
        rpm = 60 * speed.value_hz
        about = {"rig_source": "measured", "shaft_rpm": rpm, "rig_shaft_rpm": rpm}
        yield _build_line_row(fault, model, measured, runs[fault], parts) | about


def _build_line_row(
    fault: Fault, model: QuantityValue, rig: QuantityValue, run: Run, parts: Mapping[str, float]
) -> Row:
    """Build the table row that compares the frequency of a fault line in model and rig [Hz].

    `parts` are parts of the error's uncertainty [%]. The row also contains the frequency from the cage speed of `run`.
    """
    assert rig.kinematic is not None, "Table 6 states it, and so does every analysis"
    error_pct = deviation_pct(model.value, rig.value)
    made = comparison_row(model=model, rig=rig, error=error_pct, parts=parts)
    return {
        "defect": fault,
        "line": fault.line,
        "kinematic_hz": rig.kinematic,
        "model_hz": model.value,
        "model_ci95_hz": model.ci95,
        "model_deviation_pct": deviation_pct(model.value, rig.kinematic),
        "rig_hz": rig.value,
        "rig_ci95_hz": rig.ci95,
        "rig_shaft_rpm": None,
        "rig_deviation_pct": deviation_pct(rig.value, rig.kinematic),
        "comparison_error_pct": error_pct,
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


def check_table6_sums(
    printed: Mapping[Fault, Published],
    paper: Mapping[Fault, Analysis],
    runs: Mapping[str, Run],
    rig: Mapping[Fault, Analysis],
) -> Iterator[Row]:
    """Check that BPFO + BPFI orders equal the number of rollers, for Table 6, our model and the rig's recordings."""
    shaft_hz, rollers = printed[Fault.OUTER].rpm / 60, paper[Fault.OUTER].bearing.rolling_elements
    for name, key in (("kinematic, as printed", "kinematic"), ("paper's model", "model"), ("paper's rig", "rig")):
        orders = [getattr(printed[fault], f"{key}_hz") / shaft_hz for fault in RACE_DEFECTS]
        yield check_race_sum(name, "published", rollers, orders, None, 60 * shaft_hz)
    outer, inner = (runs[f"paper-{state}"].cage_ratio for state in RACE_DEFECTS)
    yield _check_recorded_sum("our model, two runs", "simulated", paper, rollers * (outer - inner))
    if all(fault in rig and rig[fault].line_of(fault).detected for fault in RACE_DEFECTS):
        rpm = rig[Fault.OUTER].recording.nominal_rpm
        yield _check_recorded_sum(f"rig recordings, {rpm:g} rpm nominal", "measured", rig)


def _check_recorded_sum(source: str, origin: str, sides: Mapping[Fault, Analysis], slip: float = 0.0) -> Row:
    orders, ci95 = [], []
    for fault in RACE_DEFECTS:
        line, speed = read_first_harmonic(sides[fault], fault), sides[fault].speed
        orders.append(line.value / speed.value_hz)
        ci95.append(math.hypot((line.ci95 or 0.0) / line.value, speed.ci95_hz / speed.value_hz) * orders[-1])
    rpm = 60 * sum(sides[fault].speed.value_hz for fault in RACE_DEFECTS) / 2
    rollers = sides[Fault.OUTER].bearing.rolling_elements
    return check_race_sum(source, origin, rollers, orders, math.hypot(*ci95), rpm, slip)


def read_first_harmonic(analysis: Analysis, fault: Fault) -> QuantityValue:
    """Read a fault line's frequency [Hz], and its value in pure rolling; `DataError` if the record is too short."""
    line = analysis.line_of(fault)
    if line.found_hz is None:
        raise DataError(f"{analysis.recording.name}: {fault.line} cannot be read; the record is too short.")
    return QuantityValue(value=line.found_hz, ci95=line.ci95_hz or 0.0, kinematic=line.kinematic_hz)
