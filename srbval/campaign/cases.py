"""From a campaign to its table of cases: scenes checked, models chosen, results named, costs estimated."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from srbval.campaign.quantities import Output
from srbval.campaign.settings import Campaign, nested
from srbval.campaign.worker import COMPUTED_BY
from srbval.errors import ConfigurationError, DataError, SrbvalError, UnknownNameError
from srbval.models.hierarchy import AUTO, check_known, level_of
from srbval.models.run_file import scene_content
from srbval.models.solvers import METHODS
from srbval.plan.measured import table_about
from srbval.plan.plan import make_plan
from srbval.scene import Scene, merge, paper_scene
from srbval.storage.content_store import content_key
from srbval.sweep.pool import right_hand_sides_per_step

FILE_BYTES = 16_384  # size of a result file without signals
COLUMNS = {Output.ACCELERATION: 4, Output.SIGNALS: 22}  # of 8-byte numbers, the time axis included
LESSER_WEIGHT = 1e-3  # cost of one output sample of a simpler model in right-hand sides of the full one, roughly
GUESSED_S = 2e-5  # wall time of one right-hand side of the full model on a slow machine


@dataclass(frozen=True, kw_only=True, slots=True)
class CampaignCase:
    """A row of the table of cases.

    `key` names the result; `point` lists the changes of the base scene by dotted key; `expected_s` is the wall time on
    the machine that the models were measured on, None if unknown, and `planned_s` the same or else a rough guess;
    `refused` is the reason why no scene could be made of the point.
    """

    index: int
    key: str
    point: Mapping[str, Any]
    model: str = ""
    solver: str = ""
    expected_s: float | None = None
    planned_s: float = 0.0
    expected_bytes: int = FILE_BYTES
    refused: str | None = None


def plan_cases(campaign: Campaign) -> list[CampaignCase]:
    """All cases. A point of which no scene can be made is a case too, with the reason.

    Raises `ConfigurationError` if axes contradict each other or contain an unknown key, unit or other word, and
    the errors of `make_plan`.
    """
    return [_case(campaign, index, point) for index, point in enumerate(campaign.points())]


def scene_of(campaign: Campaign, point: Mapping[str, Any]) -> Scene:
    """The scene of a point, its model still as the campaign states it; raises all that reading a scene raises, and
    `UnknownNameError` for an unknown model or solver.
    """
    scene = paper_scene(**merge(campaign.scene, nested(point)))
    if scene.model != AUTO:
        level_of(scene.model)
    check_known("solver", scene.solver.name, tuple(METHODS))
    return scene


def final_scene(campaign: Campaign, case: CampaignCase) -> Scene:
    """The scene that a planned case runs."""
    return replace(scene_of(campaign, case.point), model=case.model)


def totals(cases: Sequence[CampaignCase]) -> dict[str, Any]:
    """Sums over a plan; cases of the same content count once in `different`, time and disk.

    `expected_s` is wall time on one core of the machine that the models were measured on, None if unknown.
    """
    unique = {case.key: case for case in cases}.values()
    known = [case.expected_s for case in unique if not case.refused]
    return {
        "cases": len(cases),
        "different": len(unique),
        "models": dict(Counter(case.model for case in cases if not case.refused)),
        "refused": sum(case.refused is not None for case in cases),
        "expected_s": None if None in known else sum(e for e in known if e is not None),
        "expected_bytes": sum(case.expected_bytes for case in unique),
    }


def _case(campaign: Campaign, index: int, point: Mapping[str, Any]) -> CampaignCase:
    try:
        scene = scene_of(campaign, point)
        if scene.model == AUTO:
            plan = make_plan(scene, question=campaign.question, tolerance_pct=campaign.tolerance_pct)
            scene = replace(scene, model=plan.chosen)
        key = content_key(f"{' '.join(sorted(campaign.outputs))} {scene_content(scene)}", computed_by=COMPUTED_BY)
    except UnknownNameError as error:
        raise _misspelt(campaign, point, error) from None
    except DataError:
        raise
    except SrbvalError as error:
        key = content_key(f"{json.dumps(point, sort_keys=True, default=str)} {error}", computed_by=COMPUTED_BY)
        return CampaignCase(index=index, key=key, point=point, refused=str(error))
    guessed_s, expected_s = _cost(scene)
    columns = max(COLUMNS.get(output, 0) for output in campaign.outputs)
    return CampaignCase(
        index=index,
        key=key,
        point=point,
        model=scene.model,
        solver=scene.solver.name,
        expected_s=expected_s,
        planned_s=guessed_s if expected_s is None else expected_s,
        expected_bytes=FILE_BYTES + 8 * columns * scene.samples,
    )


def _misspelt(campaign: Campaign, point: Mapping[str, Any], error: UnknownNameError) -> ConfigurationError:
    """The `error` of a point with the axis that causes it, or with the table `scene` that all points share."""

    place = "scene"
    for name, part in {"scene": {}, **{f"axis {key!r}": {key: value} for key, value in point.items()}}.items():
        try:
            scene_of(campaign, part)
        except UnknownNameError:
            place = name
            break
        except SrbvalError:
            continue
    known = f" Known: {', '.join(sorted(error.known))}." if error.known else ""
    said = str(error).removeprefix("scene: ")
    return ConfigurationError(f"campaign {campaign.name}, {place}: {said}{known} Nothing was run.")


def _cost(scene: Scene) -> tuple[float, float | None]:
    """Wall time [s]: a guess from the number of right-hand sides, and the measured one, None if unknown."""
    seconds, lesser = scene.settle_s + scene.duration_s, level_of(scene.model).own_solver is not None
    each = right_hand_sides_per_step(scene.solver.name) or 1
    weight = LESSER_WEIGHT * seconds * scene.output_rate_hz if lesser else seconds * each / scene.solver.step_s
    try:
        table = table_about(scene)
    except DataError:
        return GUESSED_S * weight, None
    pace, measured = table.pace.get(scene.model), table.values
    if pace is not None and not lesser:
        other = right_hand_sides_per_step(measured["solver.name"]) or 1
        pace *= each / other * measured["solver.step_s"] / scene.solver.step_s
    return GUESSED_S * weight, None if pace is None else pace * seconds
