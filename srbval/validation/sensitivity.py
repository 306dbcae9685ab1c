"""What numerics and open inputs do to each compared quantity: one run a term, its change from the base run."""

from __future__ import annotations

import dataclasses
import math
import statistics
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

from srbval.bearing import DEFAULT_BEARING, load_bearing
from srbval.config.strict import read_toml
from srbval.models.run import Run
from srbval.recordings import State
from srbval.recordings.from_run import recording_from_run
from srbval.scene import paper_scene
from srbval.validation.analyse import analyse
from srbval.validation.cases import DEFECT_OF, Case
from srbval.validation.quantities import LINE_OF, Quantity, quantities
from srbval.validation.run_cases import Progress, run_cases
from srbval.validation.speed_and_slip import published_speeds

BASE = "base"
NOMINAL_RPM = 877.0  # the rig's speed that recordings of both faults are open for
SECONDS = 3.0


@dataclass(frozen=True, kw_only=True)
class Term:
    """One thing that is not known: numerics or input, where from, and what it changes in scene, bearing or speed."""

    name: str
    kind: str
    source: str
    ensemble: str = ""
    changes: dict[str, Any] = field(default_factory=dict)
    geometry: dict[str, Any] = field(default_factory=dict)
    relative_speed: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Effect:
    """What one term (or ensemble of terms) does to one quantity of one defect: a 95 % bound, in `unit`."""

    term: str
    kind: str
    source: str
    defect: str
    quantity: str
    unit: str
    base: float
    bound: float

    @property
    def bound_pct(self) -> float:
        """The bound relative to the base, for quantities that have a size [%]."""
        return 100 * self.bound / abs(self.base)


def terms() -> tuple[Term, ...]:
    """The table of terms."""
    table = read_toml(Path(str(resources.files("srbval.validation") / "budget.toml")))
    return tuple(Term(**row) for row in table["term"])


def measure(
    *, seconds: float = SECONDS, jobs: int | None = None, progress: Progress | None = None
) -> tuple[Effect, ...]:
    """Run every term on both faults at the rig's speed and take the changes; raises what runs and analyses raise."""
    found: dict[tuple[str, State], tuple[Quantity, ...]] = {}
    listed = terms()
    with tempfile.TemporaryDirectory() as folder:
        files = {t.name: _bearing_file(t, Path(folder)) for t in listed}
        cases = list(_cases(listed, files, seconds))
        runs = run_cases(cases, jobs=jobs, progress=progress)
        for case in cases:
            recording = recording_from_run(runs[case.id])
            analysis = analyse(recording, bearing=load_bearing(DEFAULT_BEARING))
            read = quantities(analysis, case.state)
            found[case.purpose, case.state] = (_by_cage(read[0], runs[case.id]), *read[1:])
    return tuple(effect for state in LINE_OF for effect in _effects(listed, found, state))


def _by_cage(line: Quantity, run: Run) -> Quantity:
    """The line's order from the run's mean cage speed: a change in it is not lost in the reading's noise."""
    hz = run.bpfo_hz if line.name == "BPFO" else run.bpfi_hz
    return dataclasses.replace(line, value=2 * math.pi * hz / run.scene.shaft_speed_rad_s, ci95=0.0)


def _cases(listed: Sequence[Term], files: Mapping[str, str], seconds: float) -> Iterator[Case]:
    speeds = {m.state: m.mean_rpm for m in published_speeds().means if m.nominal_rpm == NOMINAL_RPM}
    for state in LINE_OF:
        for term in (Term(name=BASE, kind="", source=""), *listed):
            defect = {"kind": DEFECT_OF[state], **term.changes.get("defect", {})}
            changes = {**term.changes, "defect": defect, "bearing": files.get(term.name, DEFAULT_BEARING)}
            shaft = 2 * math.pi * speeds[state] / 60 * term.relative_speed
            scene = paper_scene(duration_s=seconds, shaft_speed_rad_s=shaft, **changes)
            yield Case(id=f"{state}-{term.name}", purpose=term.name, state=state, scene=scene)


def _bearing_file(term: Term, folder: Path) -> str:
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
    listed: Sequence[Term], found: Mapping[tuple[str, State], tuple[Quantity, ...]], state: State
) -> Iterator[Effect]:
    for base in found[BASE, state]:
        ensembles: dict[str, list[float]] = {}
        for term in listed:
            value = _value(found[term.name, state], base.name)
            if value is None:
                continue
            if term.ensemble:
                ensembles.setdefault(term.ensemble, [base.value]).append(value)
            else:
                yield _effect(term, state, base, abs(value - base.value))
        for name, values in ensembles.items():
            first = next(t for t in listed if t.ensemble == name)
            yield _effect(dataclasses.replace(first, name=name), state, base, _interval(values))


def _effect(term: Term, state: State, base: Quantity, bound: float) -> Effect:
    return Effect(
        term=term.name,
        kind=term.kind,
        source=term.source,
        defect=state.value,
        quantity=base.name,
        unit=base.unit,
        base=base.value,
        bound=bound,
    )


def _interval(values: Sequence[float]) -> float:
    """95 % half width of one run among repeats, Student's."""
    import scipy.special

    return float(scipy.special.stdtrit(len(values) - 1, 0.975)) * statistics.stdev(values)


def _value(found: Sequence[Quantity], name: str) -> float | None:
    return next((q.value for q in found if q.name == name), None)


def effects_of(rows: Sequence[Mapping[str, Any]]) -> tuple[Effect, ...]:
    """Effects from plain values, as stored."""
    return tuple(Effect(**row) for row in rows)
