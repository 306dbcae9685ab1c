"""Choice of the cheapest model whose measured error is within the tolerance of a question."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from srbval.bearing import Bearing, load_bearing
from srbval.errors import ConfigurationError
from srbval.models.hierarchy import FidelityLevel, check_known, geometry_of, level_of
from srbval.models.planar.ring import make_ring
from srbval.plan.measured import REMEDY, Bound, MeasuredErrors, nearest_table
from srbval.plan.questions import MEANING, Question, asked_of
from srbval.scene import Scene, load_scene

if TYPE_CHECKING:
    import pandas

IN_THE_PLANE = ("impulse", "planar")


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """Model considered for a scene: error bound [%], wall time [s] (None if unknown); `ok` if accurate enough."""

    model: str
    error_pct: float | None = None
    wall_s: float | None = None
    ok: bool = False
    why: str
    bound: Bound | None = None


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Model `chosen` to answer a `question` about a scene, for example on its line frequencies.

    `met`: some model is known to be accurate enough. `outside`: why measured errors do not apply to the scene.
    """

    chosen: str
    question: Question
    tolerance_pct: float
    met: bool
    candidates: tuple[Candidate, ...]
    outside: tuple[str, ...]

    def to_frame(self) -> "pandas.DataFrame":
        """Table of all models that were considered, one row each."""
        import pandas

        return pandas.DataFrame([vars(one) for one in self.candidates]).drop(columns="bound")

    @property
    def tolerance(self) -> str:
        """Tolerance as text with its unit."""
        return MEANING[self.question].text(self.tolerance_pct)


def make_plan(
    scene: Scene | str | Path,
    *,
    question: Question | str = Question.LINES,
    tolerance_pct: float = 0.5,
    measured: MeasuredErrors | None = None,
) -> Plan:
    """Choose the cheapest model that answers `question` on `scene` with an error within `tolerance_pct` [%].

    `scene` may be a name or file. A model is accurate enough if its error bound (see `MeasuredErrors.bound`) is within
    the tolerance. If no model is, or if the measured errors do not apply to the scene, `met` is False, and the
    reference model is chosen if it can run the scene. `measured` replaces the stored errors. Raises
    `ConfigurationError` for a tolerance that is not positive, a question that does not apply to the defect, or a scene
    that no model can run.
    """
    scene = scene if isinstance(scene, Scene) else load_scene(scene)
    check_known("question", question, tuple(one.value for one in Question))
    question = Question(question)
    if not (math.isfinite(tolerance_pct) and tolerance_pct > 0):
        raise ConfigurationError(f"tolerance {tolerance_pct:g} % must be a positive number: try --tolerance 0.5.")
    if question not in asked_of(scene.defect.kind):
        raise ConfigurationError(
            f"question {question.value!r} does not apply to defect {scene.defect.kind.scene_word}: a healthy bearing "
            "has no fault line, and the outer race's line has no shaft sidebands. "
            f"Give --defect {' or '.join(MEANING[question].states)}."
        )
    table, bearing = measured or nearest_table(scene), load_bearing(scene.bearing)
    outside, levels = table.list_gaps(scene), [level_of(name) for name in table.models]
    judged = [_judge_model(one, scene, question, tolerance_pct, table, bool(outside)) for one in levels]
    # The cheapest accurate model that can run; else the reference, the most detailed model that answers, or any model.
    enough = sorted((one for one in judged if one.ok), key=lambda one: math.inf if one.wall_s is None else one.wall_s)
    detailed = [*levels[::-1]]
    detailed.sort(key=lambda level: (question.value in level.lacks, level.name != table.reference))
    few_can = scene.oil is not None or scene.bodies.free_rollers  # else the slow examination is for chosen models only
    refused = {one.name: refusal(one, scene, bearing) for one in levels if few_can or not one.runs(bearing)}
    for chosen in (*(one.model for one in enough), *(level.name for level in detailed)):
        if chosen not in refused:
            refused[chosen] = refusal(level_of(chosen), scene, bearing)
        if refused[chosen] is None:
            break
    else:
        raise ConfigurationError(f"no model runs this scene: {'; '.join(dict.fromkeys(map(str, refused.values())))}")
    return Plan(
        chosen=chosen,
        question=question,
        tolerance_pct=tolerance_pct,
        met=any(one.model == chosen for one in enough),
        candidates=tuple(Candidate(model=c.model, why=why) if (why := refused.get(c.model)) else c for c in judged),
        outside=outside,
    )


def _judge_model(
    level: FidelityLevel, scene: Scene, question: Question, tolerance_pct: float, table: MeasuredErrors, outside: bool
) -> Candidate:
    """Compare a model's measured error with the tolerance; `outside`: the measurements do not apply to the scene."""
    pace, asked, ok = table.pace.get(level.name), MEANING[question], False
    lacking, bound = level.lacks.get(question.value), table.bound(scene, level.name, question)
    error = bound.error_pct if bound is not None and lacking is None and not outside else None
    if lacking is not None:
        why = f"cannot answer: {lacking}"
    elif outside:
        why = "not known: the scene lies outside what was measured"
    elif bound is None:
        why = f"not known: {asked.title} was measured on too few scenes about {table.base}; {REMEDY}"
    elif error is None:
        why = f"gave no answer on {bound.silent} of {bound.scenes} scenes like this one"
    else:
        ok = error <= tolerance_pct and error < asked.vacuous_pct
        size = f"{asked.text(error)} {'of' if asked.unit == '%' else 'in'} {asked.error_of}"
        verdict = f"errs by up to {size}, which {'is within' if ok else 'exceeds'} {asked.text(tolerance_pct)}"
        why = f"not known: its bound, {size}, is vacuous" if error >= asked.vacuous_pct else verdict
        why += f", with a chance of {100 * bound.coverage:.0f} % from {bound.scenes} scenes"
    wall_s = None if pace is None else pace * (scene.duration_s + scene.settle_s)
    bound = None if error is None else bound
    return Candidate(model=level.name, error_pct=error, wall_s=wall_s, ok=ok, why=why, bound=bound)


def refusal(level: FidelityLevel, scene: Scene, bearing: Bearing) -> str | None:
    """Reason why a model cannot run the scene; None if it can."""
    try:
        level.check_scene(scene)
        if not level.runs(bearing):
            geometry_of(bearing, level.name)
        elif level.parameters is not None:
            level.make_parameters(scene, geometry_of(bearing))
        elif level.name in IN_THE_PLANE:
            make_ring(scene, bearing)
    except ConfigurationError as error:
        return str(error)
    return None
