"""Cases of a campaign: check the scenes, choose the models, name the results and estimate the cost."""

import contextlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from srbval.campaign.results import COMPUTED_BY, Output
from srbval.campaign.settings import Campaign
from srbval.errors import ConfigurationError, DataError, SrbvalError, UnknownNameError
from srbval.models.hierarchy import AUTO, check_known, level_of
from srbval.models.run_file import scene_content
from srbval.models.solvers import METHODS
from srbval.plan.measured import nearest_table
from srbval.plan.plan import make_plan
from srbval.scene import Scene, merge, paper_scene
from srbval.storage.content_store import content_key
from srbval.storage.tables import nest_value
from srbval.sweep.pool import right_hand_sides_per_step

FILE_BYTES = 16_384  # size of a result file without signals
SIGNAL_COLUMNS = {Output.ACCELERATION: 4, Output.SIGNALS: 22}  # columns of 8-byte numbers, time axis included
LESSER_WEIGHT = 1e-3  # cost of one output sample of a simpler model in right-hand sides of the full one, roughly
GUESSED_S = 2e-5  # wall time of one right-hand side of the full model on a slow machine


@dataclass(frozen=True, kw_only=True, slots=True)
class CampaignCase:
    """One case of a campaign.

    `key` names the result file; `point` contains the changes of the base scene by dotted key, such as ``defect.kind``.
    `expected_s` is the wall time [s] that follows from stored timings of the model, None if there are none; `planned_s`
    is the same time, or a rough guess if there are no timings. `refused` is the reason if the scene is not valid.
    """

    index: int
    key: str
    point: Mapping[str, Any]
    model: str = ""
    expected_s: float | None = None
    planned_s: float = 0.0
    expected_bytes: int = FILE_BYTES
    refused: str | None = None


def plan_cases(campaign: Campaign) -> list[CampaignCase]:
    """List all cases; if the inputs of a case give no valid scene, its `refused` contains the reason."""
    return [_plan_case(campaign, index, point) for index, point in enumerate(campaign.points())]


def scene_of_point(campaign: Campaign, point: Mapping[str, Any]) -> Scene:
    """Build the scene of a case: the campaign's base scene with the changes `point`; its model may be ``auto``."""
    table: Mapping[str, Any] = campaign.scene
    for key, value in point.items():
        table = merge(table, nest_value(key, value))
    scene = paper_scene(**table)
    if scene.model == AUTO or not level_of(scene.model).outside:  # an outside model has its own solvers
        check_known("solver", scene.solver.name, tuple(METHODS))
    return scene


def _plan_case(campaign: Campaign, index: int, point: Mapping[str, Any]) -> CampaignCase:
    try:
        scene = scene_of_point(campaign, point)
        if scene.model == AUTO:
            plan = make_plan(scene, question=campaign.question, tolerance_pct=campaign.tolerance_pct)
            scene = replace(scene, model=plan.chosen)
    except UnknownNameError as error:
        known = f" Known: {', '.join(sorted(error.known))}." if error.known else ""
        raise ConfigurationError(f"campaign {campaign.name}, case {index}: {error}{known} Nothing was run.") from None
    except DataError:
        raise
    except SrbvalError as error:
        key = content_key(f"{json.dumps(point, sort_keys=True, default=str)} {error}", computed_by=COMPUTED_BY)
        return CampaignCase(index=index, key=key, point=point, refused=str(error))
    planned_s, expected_s = cost_of(scene)
    return CampaignCase(
        index=index,
        key=content_key(f"{' '.join(sorted(campaign.outputs))} {scene_content(scene)}", computed_by=COMPUTED_BY),
        point=point,
        model=scene.model,
        expected_s=expected_s,
        planned_s=planned_s,
        expected_bytes=FILE_BYTES
        + 8 * max(SIGNAL_COLUMNS.get(output, 0) for output in campaign.outputs) * scene.samples,
    )


def cost_of(scene: Scene) -> tuple[float, float | None]:
    """Planned and expected wall time [s] of a simulation: equal, or a rough guess and None if no timings are stored."""
    seconds, lesser = scene.settle_s + scene.duration_s, level_of(scene.model).own_solver is not None
    each = right_hand_sides_per_step(scene.solver.name)
    with contextlib.suppress(DataError):  # no measured times are stored
        table = nearest_table(scene)
        if (pace := table.pace.get(scene.model)) is not None:
            other = right_hand_sides_per_step(table.values["solver.name"]) / table.values["solver.step_s"]
            expected_s = pace * seconds * (1.0 if lesser else each / scene.solver.step_s / other)
            return expected_s, expected_s
    weight = LESSER_WEIGHT * seconds * scene.output_rate_hz if lesser else seconds * each / scene.solver.step_s
    return GUESSED_S * weight, None
