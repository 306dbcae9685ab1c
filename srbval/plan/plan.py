"""Choose the cheapest model whose measured error answers the question."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

from srbval.bearing import Bearing, load_bearing
from srbval.errors import ConfigurationError
from srbval.models.hierarchy import LEVELS, FidelityLevel, geometry_of, level_of
from srbval.models.kinematic import refuse_axial
from srbval.models.planar.ring import make_ring
from srbval.plan.calibrated import Neighbours, calibration_of, neighbours
from srbval.plan.questions import MEANING, Question, asked_of
from srbval.plan.table import BASES, CalibrationTable
from srbval.scene import Scene

IN_THE_PLANE = ("impulse", "planar")
NOTHING_KNOWN = "nothing is known of its error here"
VACUOUS_PCT = 100.0  # an error bound as large as what is asked for says nothing


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A model: bound of its error [%], wall time [s] on the calibration's machine, whether it is enough (`ok`), why.

    The bound holds with a chance of at least `coverage`, read from so many `scenes`; both None without one.
    """

    model: str
    error_pct: float | None = None
    coverage: float | None = None
    scenes: int | None = None
    wall_s: float | None = None
    ok: bool
    why: str


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The choice. `outside`: what puts the scene outside the calibrated range; `met`: whether any is enough."""

    JSON_PROPERTIES: ClassVar = ("error_of",)

    chosen: str
    question: Question
    tolerance_pct: float
    met: bool
    candidates: tuple[Candidate, ...]
    outside: tuple[str, ...]

    @property
    def tolerance(self) -> str:
        """The tolerance in words."""
        return MEANING[self.question].text(self.tolerance_pct)

    @property
    def error_of(self) -> str:
        """What the errors are relative to."""
        return MEANING[self.question].error_of


def make_plan(
    scene: Scene,
    *,
    question: Question = Question.LINES,
    tolerance_pct: float = 0.5,
    calibration: CalibrationTable | None = None,
) -> Plan:
    """The cheapest model that answers `question` on `scene` within `tolerance_pct`.

    Errors are the largest of the calibration scenes about this one, against their reference model at half its step,
    times the margin that the scenes between those call for (`margins`): bounds that hold with the chance they state.
    Outside the calibrated range only the reference model is enough. If even its error is larger, it is chosen all the
    same and `met` is False. Raises `ConfigurationError` for a tolerance that is not positive, or a question that a
    scene without defect leaves empty.
    """
    if not (math.isfinite(tolerance_pct) and tolerance_pct > 0):
        raise ConfigurationError(f"tolerance {tolerance_pct:g} % must be a positive number: try --tolerance 0.5.")
    if question not in asked_of(scene.defect.kind):
        raise ConfigurationError(
            f"question {question.value!r}, defect {scene.defect.kind.scene_word}: a healthy bearing has no fault line "
            "to ask about, the outer race's no sidebands of the shaft; give --defect outer or inner."
        )
    table = calibration or calibration_of(scene)
    near = neighbours(table, scene)
    if not any(question in entry.reference for entry in table.entries):
        command = "srbval study run model_hierarchy"
        unasked = f"{MEANING[question].title}: not measured about the scene {table.base}; {command} does so"
        near = replace(near, outside=(*near.outside, unasked))
    candidates, chosen = _choose(scene, question, tolerance_pct, table, near)
    return Plan(
        chosen=chosen, question=question, tolerance_pct=tolerance_pct, met=any(c.ok for c in candidates),
        candidates=candidates, outside=near.outside,
    )  # fmt: skip


def _choose(
    scene: Scene, question: Question, tolerance_pct: float, table: CalibrationTable, near: Neighbours
) -> tuple[tuple[Candidate, ...], str]:
    """All candidates, and the name of the cheapest that is enough and does not refuse the scene.

    Where none is enough, the reference model; where that refuses, the last model that does not and knows the question.
    """
    levels, bearing = [level for level in LEVELS if level.name in table.models], load_bearing(scene.bearing)
    tables = scene.oil is not None or scene.bodies.free_rollers  # that only some models know
    refused = {
        level.name: why for level in levels
        if (tables or not level.runs(bearing)) and (why := refusal(level, scene, bearing)) is not None
    }  # fmt: skip
    while True:
        able = [r for r in levels if r.name not in refused]
        knowing = [r.name for r in able if question.value not in r.lacks] or [r.name for r in able]
        if not knowing:
            raise ConfigurationError(f"no model runs this scene: {'; '.join(dict.fromkeys(refused.values()))}")
        right = BASES[table.base].reference
        reference = right if right in knowing else knowing[-1]
        candidates = [
            Candidate(model=level.name, ok=False, why=refused[level.name]) if level.name in refused
            else _judge(level, scene, question, tolerance_pct, near, reference)
            for level in levels
        ]  # fmt: skip
        enough = [c for c in candidates if c.ok]
        chosen = min(enough, key=lambda c: math.inf if c.wall_s is None else c.wall_s).model if enough else reference
        why = refusal(level_of(chosen), scene, bearing)
        if why is None:
            return tuple(candidates), chosen
        refused[chosen] = why


def _judge(
    level: FidelityLevel, scene: Scene, question: Question, tolerance_pct: float, near: Neighbours, reference: str
) -> Candidate:
    error = near.error_pct(level.name, question)
    pace = near.wall_per_simulated_s(level.name)
    margin = near.margin_of(level.name, question) if error is not None else None
    ok, why = _verdict(level, question, error, tolerance_pct, near, level.name == reference)
    if margin is not None and not near.outside and question.value not in level.lacks:
        why += f" (with a chance of {100 * margin.coverage:.0f} %, from {margin.scenes} scenes)"
    return Candidate(
        model=level.name, error_pct=error, ok=ok, why=why,
        coverage=None if margin is None else margin.coverage,
        scenes=None if margin is None else margin.scenes,
        wall_s=None if pace is None else pace * (scene.duration_s + scene.settle_s),
    )  # fmt: skip


def _verdict(
    level: FidelityLevel, question: Question, error: float | None, tolerance_pct: float, near: Neighbours, right: bool
) -> tuple[bool, str]:
    """Whether a model is enough, the one that is `right` by definition outside what was measured, and why."""
    if (lacking := level.lacks.get(question.value)) is not None:
        return False, f"cannot answer: {lacking}"
    if near.outside:
        own = "this is the reference model, its own error unknown here"
        return right, f"the scene lies outside what was measured: {own if right else NOTHING_KNOWN}"
    if error is None:
        return False, "gave no answer on a calibration scene near this one, or on too many between them"
    asked = MEANING[question]
    bound = f"{asked.text(error)} {'of' if asked.unit == '%' else 'in'} {asked.error_of}"
    if error >= VACUOUS_PCT and asked.unit == "%":
        return error <= tolerance_pct, f"nothing useful is known: its bound, {bound}, is vacuous"
    verb = "is within" if error <= tolerance_pct else "exceeds"
    return error <= tolerance_pct, f"errs by up to {bound}, which {verb} {asked.text(tolerance_pct)}"


def refusal(level: FidelityLevel, scene: Scene, bearing: Bearing) -> str | None:
    """Why the model refuses the scene; None where it assembles it."""
    try:
        level.check_scene(scene)
        if not level.runs(bearing):
            geometry_of(bearing, level.name)
        elif level.parameters is not None:
            level.make_parameters(scene, geometry_of(bearing))
        elif level.name in IN_THE_PLANE:
            refuse_axial(scene)
            if bearing.pitch_diameter_m is not None:
                make_ring(scene, bearing)
    except ConfigurationError as error:
        return str(error)
    return None
