"""The effect of numerics and open inputs on each compared quantity: one run per term, and its change from the base."""

import math
import statistics
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import DEFAULT_BEARING, DEFECTS, Fault, load_bearing
from srbval.config.strict import read_toml
from srbval.progress import Progress, silent
from srbval.scene import paper_scene
from srbval.validation.compared_quantities import COMPARED, own_effects, value_of_model
from srbval.validation.counterpart import DETAIL_HZ, AnalysedRun, analyse_run
from srbval.validation.effects import Effect, Sensitivity, ShapeEffect
from srbval.validation.simulation_cases import SimulationCase, run_cases
from srbval.validation.spectrum_shape import halves_of
from srbval.validation.speed_and_slip import published_speeds

BASE = "base"
ROWS = tuple(row for row in COMPARED if row.effects is own_effects)  # whose value a term changes
NOMINAL_RPM = 877.0  # the rig's speed that recordings of both faults are open for
SECONDS = 3.0

Values = Mapping[str, float]  # of the compared quantities, by name


@dataclass(frozen=True, kw_only=True)
class UncertaintyTerm:
    """One term of the uncertainty: numerics or input, its source, and what it changes in scene, bearing or speed."""

    name: str
    kind: str
    source: str
    ensemble: str = ""
    changes: dict[str, Any] = field(default_factory=dict)
    geometry: dict[str, Any] = field(default_factory=dict)
    relative_speed: float = 1.0

    def effect_on(self, state: Fault) -> dict[str, str]:
        """What its effects on a state have in common; those of an ensemble go by its name."""
        term = self.ensemble or self.name
        return {"term": term, "kind": self.kind, "source": self.source, "defect": state.value}


def terms() -> tuple[UncertaintyTerm, ...]:
    """The table of terms."""
    table = read_toml(Path(str(resources.files("srbval.validation") / "budget.toml")))
    return tuple(UncertaintyTerm(**row) for row in table["term"])


def measure(*, seconds: float = SECONDS, jobs: int | None = None, progress: Progress = silent) -> Sensitivity:
    """Run every term on every fault at the rig's speed and take the changes; raises what runs and analyses raise."""
    found: dict[tuple[str, Fault], Values] = {}
    shapes: dict[tuple[str, Fault], NDArray[np.float64] | None] = {}
    listed, bearing = terms(), load_bearing(DEFAULT_BEARING)
    with tempfile.TemporaryDirectory() as folder:
        files = {t.name: _bearing_file(t, Path(folder)) for t in listed}
        cases = list(_cases(listed, files, seconds))
        runs = run_cases(cases, jobs=jobs, progress=progress)
        for case in cases:
            analysed = analyse_run(case, runs[case.id], bearing)
            found[case.purpose, case.state] = _values(analysed, case.state)
            shapes[case.purpose, case.state] = halves_of(analysed.analysis, case.state)
    return Sensitivity(
        effects=tuple(effect for state in DEFECTS for effect in _effects(listed, found, state)),
        shapes=tuple(effect for state in DEFECTS for effect in _shape_effects(listed, shapes, state)),
    )


def _values(analysed: AnalysedRun, fault: Fault) -> Values:
    """Values of the compared quantities by name, the line's order from the run's own speeds where it gives one.

    A change in it is then not lost in the reading's noise.
    """
    read = {row.name_of(fault): value_of_model(row, analysed.analysis, fault, analysed.line_order) for row in ROWS}
    return {name: value.value for name, value in read.items() if value is not None}


def _shape_effects(
    listed: Sequence[UncertaintyTerm], shapes: Mapping[tuple[str, Fault], NDArray[np.float64] | None], state: Fault
) -> Iterator[ShapeEffect]:
    """One of each term; repeats of an ensemble share its name, and the largest counts."""
    base = shapes[BASE, state]
    for term in listed:
        varied = shapes[term.name, state]
        if base is not None and varied is not None:
            yield ShapeEffect(**term.effect_on(state), base=base.round(3).tolist(), varied=varied.round(3).tolist())


def _cases(listed: Sequence[UncertaintyTerm], files: Mapping[str, str], seconds: float) -> Iterator[SimulationCase]:
    speeds = {m.state: m.mean_rpm for m in published_speeds().means if m.nominal_rpm == NOMINAL_RPM}
    for state in DEFECTS:
        for term in (UncertaintyTerm(name=BASE, kind="", source=""), *listed):
            defect = {"kind": state, **term.changes.get("defect", {})}
            changes = {**term.changes, "defect": defect, "bearing": files.get(term.name, DEFAULT_BEARING)}
            shaft = 2 * math.pi * speeds[state] / 60 * term.relative_speed
            scene = paper_scene(
                duration_s=seconds, shaft_speed_rad_s=shaft, detail_rate_hz=DETAIL_HZ.get(state, 0.0), **changes
            )
            yield SimulationCase(id=f"{state}-{term.name}", purpose=term.name, state=state, scene=scene)


def _bearing_file(term: UncertaintyTerm, folder: Path) -> str:
    """The default bearing, or a file of it with the term's geometry."""
    if not term.geometry:
        return DEFAULT_BEARING
    source = Path(str(resources.files("srbval.bearing") / "known" / f"{DEFAULT_BEARING}.toml"))
    table = read_toml(source)
    lines = [f'{key} = "{value}"' for key, value in table.items() if isinstance(value, str)]
    lines.append("[geometry]")
    for key, value in (table["geometry"] | term.geometry).items():
        lines.append(f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value}")
    path = folder / f"{DEFAULT_BEARING}-{term.name.replace(' ', '-')}.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def _effects(
    listed: Sequence[UncertaintyTerm], found: Mapping[tuple[str, Fault], Values], state: Fault
) -> Iterator[Effect]:
    for row in ROWS:
        quantity = row.name_of(state)
        base = found[BASE, state].get(quantity)
        if base is None:
            continue
        for term, bound in _bounds(listed, base, {t.name: found[t.name, state].get(quantity) for t in listed}):
            yield Effect(**term.effect_on(state), quantity=quantity, unit=row.unit, base=base, bound=bound)


def _bounds(
    listed: Sequence[UncertaintyTerm], base: float, values: Mapping[str, float | None]
) -> Iterator[tuple[UncertaintyTerm, float]]:
    """Each single term's change from the base, then Student's 95 % interval of every ensemble, by its first term."""
    from scipy.special import stdtrit

    ensembles: dict[str, list[float]] = {}
    for term in listed:
        value = values[term.name]
        if value is not None and term.ensemble:
            ensembles.setdefault(term.ensemble, [base]).append(value)
        elif value is not None:
            yield term, abs(value - base)
    for name, members in ensembles.items():
        student = float(stdtrit(len(members) - 1, 0.975))
        yield next(t for t in listed if t.ensemble == name), student * statistics.stdev(members)
