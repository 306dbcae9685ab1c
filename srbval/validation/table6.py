"""The rows of Table 6: the paper's speed against published values, the rig's speed against recordings."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from srbval.bearing import RACE_DEFECTS, Fault
from srbval.errors import DataError
from srbval.models.run import Run
from srbval.validation.analyse import Analysis
from srbval.validation.comparison import Comparison, RigSource
from srbval.validation.effects import Effect
from srbval.validation.lines import Line
from srbval.validation.published import Table6
from srbval.validation.sum_rule import SumRule, sum_rule


def published_rows(printed: Table6, paper: Mapping[Fault, Analysis], runs: Mapping[str, Run]) -> Iterator[Comparison]:
    """Our model at the paper's speed beside the paper's model and rig, against the printed kinematic frequency.

    The paper gives its rig values no uncertainty and no measured speed, so these rows cannot be resolved.
    """
    for state in RACE_DEFECTS:
        row = printed.of(state.value)
        read = found_line(paper[state], state)
        yield Comparison(
            defect=state.value,
            line=read.name,
            shaft_rpm=printed.shaft_rpm,
            kinematic_hz=row.kinematic_hz,
            model_hz=_found(read),
            model_ci95_hz=_ci95(read),
            model_cage_hz=cage_line_hz(runs[f"paper-{state}"], state),
            rig_hz=row.rig_hz,
            rig_source=RigSource.PUBLISHED,
            paper_model_hz=row.model_hz,
            paper_rig_hz=row.rig_hz,
            paper_model_printed_pct=row.model_printed_pct,
            paper_rig_printed_pct=row.rig_printed_pct,
        )


def measured_rows(
    rig: Mapping[Fault, Analysis],
    runs: Mapping[Fault, Run],
    effects: Sequence[Effect],
) -> Iterator[Comparison]:
    """Our model at each recording's measured speed beside that recording; states without a found line are left out.

    The model's line is its mean cage speed's, free of a reading's noise; `effects` tell what numerics and inputs do.
    """
    for state in RACE_DEFECTS:
        if state not in rig or not found_line(rig[state], state).detected:
            continue
        read, speed = found_line(rig[state], state), rig[state].speed
        model_hz = cage_line_hz(runs[state], state)
        yield Comparison(
            defect=state.value,
            line=read.name,
            shaft_rpm=60 * speed.value_hz,
            kinematic_hz=read.kinematic_hz,
            model_hz=model_hz,
            model_ci95_hz=0.0,
            model_cage_hz=model_hz,
            rig_hz=_found(read),
            rig_ci95_hz=_ci95(read),
            rig_source=RigSource.MEASURED,
            rig_shaft_rpm=60 * speed.value_hz,
            uncertainty_parts_pct={
                "rig reading": 100 * _ci95(read) / _found(read),
                "rig speed": 100 * speed.ci95_hz / speed.value_hz,
                **_effect_parts(read.name, effects),
            },
        )


def sum_rules(
    printed: Table6, paper: Mapping[Fault, Analysis], runs: Mapping[str, Run], rig: Mapping[Fault, Analysis]
) -> Iterator[SumRule]:
    """BPFO + BPFI of every pair there is: printed kinematic, paper's model, paper's rig, our model, the recordings.

    Our model's two runs have their own mean cage speeds, which are known; the rig's are not.
    """
    outer, inner = printed.of("outer"), printed.of("inner")
    shaft_hz = printed.shaft_rpm / 60
    rollers = paper[Fault.OUTER].bearing.rolling_elements
    for source, origin, bpfo, bpfi in (
        ("kinematic, as printed", "published", outer.kinematic_hz, inner.kinematic_hz),
        ("paper's model", "published", outer.model_hz, inner.model_hz),
        ("paper's rig", "published", outer.rig_hz, inner.rig_hz),
    ):
        yield sum_rule(source, origin, rollers, bpfo_hz=bpfo, bpfi_hz=bpfi,
                       outer_shaft_hz=shaft_hz, inner_shaft_hz=shaft_hz)  # fmt: skip
    cage = {state: runs[f"paper-{state}"].cage_ratio for state in RACE_DEFECTS}
    slip = rollers * (cage[Fault.OUTER] - cage[Fault.INNER])
    yield _read_pair("our model, two runs", "simulated", rollers, paper, slip)
    if all(s in rig and found_line(rig[s], s).detected for s in RACE_DEFECTS):
        rpm = rig[Fault.OUTER].recording.nominal_rpm
        yield _read_pair(f"rig recordings, {rpm:g} rpm nominal", "measured", rollers, rig)


def found_line(analysis: Analysis, fault: Fault) -> Line:
    """First harmonic of a line; `DataError` where it lies outside the record's reach."""
    line = analysis.line_of(fault)
    if line.found_hz is None:
        raise DataError(f"{analysis.recording.name}: {fault.line} cannot be read; the record is too short.")
    return line


def cage_line_hz(run: Run, fault: Fault) -> float:
    """A race line from the run's own mean cage speed [Hz]."""
    return run.bpfo_hz if fault is Fault.OUTER else run.bpfi_hz


def _read_pair(
    source: str, origin: str, rollers: int, sides: Mapping[Fault, Analysis], slip_difference: float = 0.0
) -> SumRule:
    outer, inner = sides[Fault.OUTER], sides[Fault.INNER]
    bpfo, bpfi = found_line(outer, Fault.OUTER), found_line(inner, Fault.INNER)
    return sum_rule(
        source,
        origin,
        rollers,
        bpfo_hz=_found(bpfo),
        bpfi_hz=_found(bpfi),
        outer_shaft_hz=outer.speed.value_hz,
        inner_shaft_hz=inner.speed.value_hz,
        ci95=(_order_ci95(outer, bpfo), _order_ci95(inner, bpfi)),
        slip_difference=slip_difference,
    )


def _order_ci95(analysis: Analysis, line: Line) -> float:
    relative = math.hypot(_ci95(line) / _found(line), analysis.speed.ci95_hz / analysis.speed.value_hz)
    return relative * _found(line) / analysis.speed.value_hz


def _effect_parts(line: str, effects: Sequence[Effect]) -> dict[str, float]:
    return {f"{e.kind}: {e.term}": e.bound_pct for e in effects if e.quantity == line}


def _found(line: Line) -> float:
    assert line.found_hz is not None, "found_line has checked this"
    return float(line.found_hz)


def _ci95(line: Line) -> float:
    return float(line.ci95_hz or 0.0)
