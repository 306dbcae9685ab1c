"""The rig scene's cage speed over its inputs' ranges, against the rig's.

Each input alone from its lowest to its highest value, then all of them together, drawn from their ranges. Ratios of
cage and shaft are compared after ASME V&V 20: error E = S - D against the uncertainty U of inputs, numerics and data.
The rig's ratios are read from its registered recordings; `--read-again` reads only these again and keeps the stored
runs.
"""

import math
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.check.quantities import RIG_RPM
from srbval.comparison.budget import TOLERANCE
from srbval.comparison.comparison import deviation_pct
from srbval.comparison.speed_and_slip import published_speeds
from srbval.errors import DataError, NumericsError
from srbval.models.simulate import Step, simulate
from srbval.progress import Progress, silent
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.recordings.registry import find_recording, load_entry
from srbval.scene import RigInput, draws, load_scene, merge, rig_inputs
from srbval.storage.stored_result import newest_result
from srbval.studies.harness import Study, StudyResult

SETTLE_S, SECONDS = 0.05, 0.1  # twelve passages; the cage ratio differs from that of two seconds by less than 1e-6
STEP_S = 1 / 61_440  # the scene's own is beyond the stiffest roller's limit where contacts are longest
STARTS = 8  # runs that differ by the load's last digits
START_SHARE = 1e-5  # of the load
FINER = {"line_contact": {"slices": 61}, "solver": {"step_s": STEP_S / 4}}
DRAWN = 7  # power of two: samples of all inputs together
COVERAGE = 2.0  # of a standard uncertainty, for 95 %
MARGIN_PCT = TOLERANCE.limit_pct  # of the cage ratio: the difference within which model and rig count as agreeing
AGREE = "agree"  # |E| + U is below the margin: nearly uniform ranges rule U, so that no one-sided 1.645 u will do
RESOLVED = "resolved"  # E exceeds U: the model's error shows
UNDECIDED = "undecided"  # E is within U, which is too wide for more
BEARING = load_bearing(DEFAULT_BEARING)


@dataclass(frozen=True, kw_only=True)
class RigLine:
    """A record of the rig: the cage ratio read from its fault line, its standard uncertainty where that is known."""

    record: str
    line: str
    kind: Fault
    rpm: float
    cage_ratio: float
    standard_uncertainty: float | None

    def share(self, cage_ratio: float) -> float:
        """The line over shaft speed and number of rollers: what rolls past a point of the race."""
        return cage_ratio if self.kind is Fault.OUTER else 1 - cage_ratio

    def percent(self, difference: float) -> float:
        """A difference of cage ratios in per cent of the line."""
        return 100 * difference / self.share(self.cage_ratio)


# Nominal speed, race and, where no recording can be had, the order that was read from it over the mean speed, which has
# no interval: shown, not judged.
RECORDS = {
    "OR 877": (RIG_RPM, Fault.OUTER, None),
    "IR 877": (RIG_RPM, Fault.INNER, None),
    "OR 353": (353.0, Fault.OUTER, 8.192),
    "IR 353": (353.0, Fault.INNER, 10.795),
}


def rig_line(record: str) -> RigLine:
    """A record at the mean speed that its authors print: read from the registered recording, else as stored.

    The uncertainty is that of the line's reading and of the shaft's mean speed over the tachometer's scatter and drift,
    as `analyse` states both. `DataError` where neither recording nor stored study is there.
    """
    nominal_rpm, kind, order = RECORDS[record]
    uncertainty = None
    if order is None:
        entry = find_recording(state=kind, nominal_rpm=nominal_rpm)
        if entry is None:
            return stored_line(record)
        analysis = analyse(load_entry(entry), bearing=BEARING)
        line, speed = analysis.line_of(kind), analysis.speed
        if line.found_hz is None or line.ci95_hz is None:
            raise DataError(f"{entry.file}: no {kind.line}.")
        order = line.found_hz / speed.value_hz
        relative = math.hypot(line.ci95_hz / line.found_hz, speed.ci95_hz / speed.value_hz)
        uncertainty = order * relative / COVERAGE / BEARING.rolling_elements
    share = order / BEARING.rolling_elements
    rpm = next(m.mean_rpm for m in published_speeds().means if (m.state, m.nominal_rpm) == (kind, nominal_rpm))
    return RigLine(
        record=record, line=kind.line or "", kind=kind, rpm=rpm,
        cage_ratio=share if kind is Fault.OUTER else 1 - share, standard_uncertainty=uncertainty,
    )  # fmt: skip


def stored_line(record: str) -> RigLine:
    """A record as the stored study has it."""
    kept = newest_result("rig_inputs")
    if kept is None:
        raise DataError(f"{record}: neither registered nor in a stored study; srbval data fetch torino-excerpts.")
    table = next(study["of"] for study in kept.content["studies"] if study["of"]["record"] == record)
    return RigLine(**table | {"kind": Fault(table["kind"])})


@dataclass(frozen=True, kw_only=True)
class InputEffect:
    """Cage ratios over the values of one input, all others nominal."""

    key: str
    unit: str
    values: tuple[float, ...]
    cage_ratios: tuple[float, ...]

    @property
    def spread(self) -> tuple[float, float]:
        """Least and greatest cage ratio."""
        return min(self.cage_ratios), max(self.cage_ratios)

    @property
    def half_spread(self) -> float:
        """Half the difference of the two."""
        return (self.spread[1] - self.spread[0]) / 2


@dataclass(frozen=True, kw_only=True)
class InputStudy:
    """What the inputs do to one line: the `nominal` cage ratio, a `finer` run's, those of other `starts`, the `effects`
    of each input, and the ratios of `drawn` inputs.
    """

    JSON_PROPERTIES: ClassVar = ("error_pct", "parts_pct", "uncertainty_pct", "verdict")

    of: RigLine
    nominal: float
    finer: float
    starts: tuple[float, ...]
    effects: tuple[InputEffect, ...]
    drawn: tuple[float, ...] = field(repr=False)

    @property
    def drawn_interval(self) -> tuple[float, float]:
        """Between which 95 % of the drawn inputs' ratios lie."""
        low, high = np.percentile(self.drawn, (2.5, 97.5))
        return float(low), float(high)

    @property
    def error_pct(self) -> float:
        """The comparison error of the line."""
        return deviation_pct(self.of.share(self.nominal), self.of.share(self.of.cage_ratio))

    @property
    def parts_pct(self) -> dict[str, float]:
        """95 % half widths in per cent of the line: inputs one by one, those drawn together, numerics, data."""
        low, high = self.drawn_interval
        numerics = math.hypot(self.finer - self.nominal, COVERAGE * float(np.std(self.starts, ddof=1)))
        parts = {
            "inputs": math.hypot(*(effect.half_spread for effect in self.effects)),
            "inputs together": (high - low) / 2,
            "numerics": numerics,
        }
        if self.of.standard_uncertainty is not None:
            parts["data"] = COVERAGE * self.of.standard_uncertainty
        return {name: self.of.percent(part) for name, part in parts.items()}

    @property
    def uncertainty_pct(self) -> float | None:
        """U of the line, with the greater of the inputs' two parts; None where the data's is not known."""
        parts = self.parts_pct
        inputs = max(parts["inputs"], parts["inputs together"])
        return math.hypot(inputs, parts["numerics"], parts["data"]) if "data" in parts else None

    @property
    def verdict(self) -> str | None:
        """What E and U allow to be said: see `AGREE`, `RESOLVED` and `UNDECIDED`; None where U is not known."""
        if self.uncertainty_pct is None:
            return None
        of_cage = self.of.share(self.of.cage_ratio) / self.of.cage_ratio  # from the line's per cent to the cage ratio's
        if of_cage * (abs(self.error_pct) + self.uncertainty_pct) < MARGIN_PCT:
            return AGREE
        return RESOLVED if abs(self.error_pct) > self.uncertainty_pct else UNDECIDED


def study_inputs(
    line: RigLine, inputs: Sequence[RigInput], *, drawn: int = DRAWN, progress: Progress = silent
) -> InputStudy:
    """Run the scene of `line` over the ranges of `inputs`, and ``2**drawn`` times with all of them drawn.

    Raises `NumericsError` where a run fails.
    """
    what = f"{line.record}: inputs"
    load_n = load_scene("rig").load.radial_n
    effects = []
    for number, one in enumerate(inputs):
        progress(what, number / (len(inputs) + 2))
        ratios = tuple(cage_ratio(line, one.changes(value)) for value in one.values)
        effects.append(InputEffect(key=one.key, unit=one.unit, values=one.values, cage_ratios=ratios))
    progress(what, len(inputs) / (len(inputs) + 2))
    together = tuple(cage_ratio(line, changes) for changes in draws(inputs, drawn))
    progress(what, 1.0)
    shares = np.linspace(-START_SHARE, START_SHARE, STARTS)
    return InputStudy(
        of=line,
        nominal=cage_ratio(line, {}),
        finer=cage_ratio(line, FINER),
        starts=tuple(cage_ratio(line, {"load": {"radial_n": load_n * (1 + share)}}) for share in shares),
        effects=tuple(effects),
        drawn=together,
    )


def read_again(study: Mapping[str, Any]) -> InputStudy:
    """A stored study with the rig's line read anew; its runs are kept, which the rig's ratio has no part in."""
    effects: Iterator[dict[str, Any]] = (
        {name: tuple(v) if isinstance(v, list) else v for name, v in effect.items()} for effect in study["effects"]
    )
    return InputStudy(
        of=rig_line(study["of"]["record"]), nominal=study["nominal"], finer=study["finer"],
        starts=tuple(study["starts"]), effects=tuple(InputEffect(**effect) for effect in effects),
        drawn=tuple(study["drawn"]),
    )  # fmt: skip


def cage_ratio(line: RigLine, changes: Mapping[str, Any]) -> float:
    """Of a run of the rig scene at the speed of a record, with its defect and these changes."""
    own = {
        "defect": {"kind": line.kind}, "shaft_speed": f"{line.rpm} rpm", "settle_s": SETTLE_S, "duration_s": SECONDS,
        "solver": {"step_s": STEP_S},
    }  # fmt: skip
    run = simulate(load_scene("rig", merge(own, changes)), step=Step.UNCHECKED)  # that is part of the study
    if not run.status.usable:
        raise NumericsError(f"rig inputs: the run with {changes} failed ({run.status}): {run.reason}")
    return run.cage_ratio


def effect_rows(study: InputStudy) -> list[dict[str, Any]]:
    """One row for each input: its range, and what the cage ratio does over it."""
    return [
        {
            "record": study.of.record, "input": effect.key, "low": effect.values[0], "high": effect.values[-1],
            "unit": effect.unit, "cage ratio at low": f"{effect.cage_ratios[0]:.6f}",
            "at high": f"{effect.cage_ratios[-1]:.6f}", "least": f"{effect.spread[0]:.6f}",
            "greatest": f"{effect.spread[1]:.6f}", "half spread [% of the line]": study.of.percent(effect.half_spread),
        }
        for effect in study.effects
    ]  # fmt: skip


def summary_row(study: InputStudy) -> dict[str, Any]:
    """Nominal value, spreads, and E against U."""
    low, high = study.drawn_interval
    parts = study.parts_pct
    return {
        "record": study.of.record, "line": study.of.line, "rpm": f"{study.of.rpm:.2f}",
        "rig": f"{study.of.cage_ratio:.5f}", "nominal": f"{study.nominal:.6f}",
        "95 % of draws": f"{low:.5f}-{high:.5f}",
        "E [%]": study.error_pct, **{f"{name} [%]": parts.get(name) for name in
                                     ("inputs", "inputs together", "numerics", "data")},
        "U [%]": study.uncertainty_pct, "verdict": study.verdict,
    }  # fmt: skip


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--read-again", action="store_true", help="read the rig's lines again, keep the stored runs")


def _run(options: Namespace, progress: Progress) -> StudyResult:
    kept, ran = newest_result("rig_inputs"), {}
    if options.read_again and kept is not None:
        studies = [read_again(study) for study in kept.content["studies"]]
        ran = {"runs_of": kept.content.get("runs_of", kept.origin)}
    else:
        studies = [study_inputs(rig_line(record), rig_inputs(), progress=progress) for record in RECORDS]
    text = "\n\n".join(text_rows(rows) for rows in (*map(effect_rows, studies), [*map(summary_row, studies)]))
    return StudyResult(name="rig_inputs", content=ran | {"seconds": SECONDS, "studies": studies}, text=text)


STUDY = Study(
    question="Where does the rig scene's cage speed lie over the ranges of its inputs, and where does the rig's?",
    minutes=40, run=_run, options=_options,
)  # fmt: skip
