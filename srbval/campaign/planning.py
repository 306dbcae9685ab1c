"""From a campaign to its cases: scenes checked, models chosen, keys of the results, expected costs."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from srbval.campaign.case import CampaignCase, case_key, refused_key
from srbval.campaign.quantities import Output
from srbval.campaign.sampling import nested, points
from srbval.campaign.settings import Campaign
from srbval.errors import DataError, SrbvalError
from srbval.models.ladder import AUTO, rung_of
from srbval.plan.calibrated import calibration_of, neighbours
from srbval.plan.plan import make_plan
from srbval.plan.table import LadderCalibration
from srbval.plan.timing import right_hand_sides_per_step
from srbval.scene import Scene, merge, paper_scene

FILE_BYTES = 16_384  # size of a result file without signals
COLUMNS = {Output.ACCELERATION: 4, Output.SIGNALS: 22}  # of 8-byte numbers, the time axis included
LESSER_WEIGHT = 1e-3  # cost of one output sample of a simpler model in right-hand sides of the full one, roughly


@dataclass(frozen=True, kw_only=True)
class PlanTotals:
    """A plan in a few numbers; `different` counts cases of unlike content once each.

    `expected_s` is wall time on one core of the calibration's machine, None where unknown.
    """

    cases: int
    different: int
    models: dict[str, int]
    refused: int
    expected_s: float | None
    expected_bytes: int


def plan_cases(campaign: Campaign) -> list[CampaignCase]:
    """All cases. A point of which no scene can be made is a case too, with the reason.

    Raises `ConfigurationError` where axes contradict each other, and what `make_plan` raises without a calibration.
    """
    return list(_cases(campaign))


def scene_of(campaign: Campaign, point: Mapping[str, Any]) -> Scene:
    """The scene of a point, its model still as the campaign says; raises what reading a scene raises."""
    return paper_scene(**merge(campaign.scene, nested(dict(point))))


def final_scene(campaign: Campaign, case: CampaignCase) -> Scene:
    """The scene that a planned case runs."""
    return replace(scene_of(campaign, case.point), model=case.model)


def totals(cases: Sequence[CampaignCase]) -> PlanTotals:
    """Add up a plan; cases of the same content count once in time and disk."""
    unique = list({case.key: case for case in cases}.values())
    known = [case.expected_s for case in unique if not case.refused]
    return PlanTotals(
        cases=len(cases),
        different=len(unique),
        models=dict(Counter(case.model for case in cases if not case.refused)),
        refused=sum(case.refused is not None for case in cases),
        expected_s=None if any(e is None for e in known) else sum(e for e in known if e is not None),
        expected_bytes=sum(case.expected_bytes for case in unique),
    )


def _cases(campaign: Campaign) -> Iterator[CampaignCase]:
    for index, point in enumerate(points(campaign)):
        try:
            scene = scene_of(campaign, point)
            if scene.model == AUTO:
                plan = make_plan(scene, question=campaign.question, tolerance_pct=campaign.tolerance_pct)
                scene = replace(scene, model=plan.chosen)
            rung_of(scene.model)
            key = case_key(scene, campaign.outputs)
        except DataError:
            raise
        except SrbvalError as error:
            yield CampaignCase(
                index=index, key=refused_key(point, str(error)), point=point, model="", solver="", weight=0.0,
                expected_s=None, expected_bytes=FILE_BYTES, refused=str(error),
            )  # fmt: skip
            continue
        yield CampaignCase(
            index=index,
            key=key,
            point=point,
            model=scene.model,
            solver=scene.solver.name,
            weight=_weight(scene),
            expected_s=_expected_s(scene),
            expected_bytes=expected_bytes(scene, campaign.outputs),
        )


def expected_bytes(scene: Scene, outputs: Sequence[Output]) -> int:
    """Size of a result file, without its detailed outputs."""
    columns = max((COLUMNS.get(output, 0) for output in outputs), default=0)
    return FILE_BYTES + 8 * columns * scene.samples


def _weight(scene: Scene) -> float:
    """Cost in right-hand sides of the full model; far less for a simpler one."""
    seconds = scene.settle_s + scene.duration_s
    if rung_of(scene.model).own_solver:
        return LESSER_WEIGHT * seconds * scene.output_rate_hz
    return seconds * (right_hand_sides_per_step(scene.solver.name) or 1) / scene.solver.step_s


def _expected_s(scene: Scene) -> float | None:
    table = _calibration(scene)
    if table is None:
        return None
    pace = neighbours(table, scene).wall_per_simulated_s(scene.model)
    if pace is None:
        return None
    if rung_of(scene.model).own_solver is None:
        each = (right_hand_sides_per_step(scene.solver.name) or 1) / (right_hand_sides_per_step(table.solver) or 1)
        pace *= each * table.step_s / scene.solver.step_s
    return pace * (scene.duration_s + scene.settle_s)


def _calibration(scene: Scene) -> LadderCalibration | None:
    try:
        return calibration_of(scene)
    except DataError:
        return None
