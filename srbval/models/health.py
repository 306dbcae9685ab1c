"""Status of a run: the behaviour of the bearing, or the failure of the integration with advice.

Explicit integration fails silently, see "Explicit methods" on the page "Time integration" of the theory. A run fails
if it violates a law that every motion of the model obeys. A bearing may skid or its rollers may be unloaded: if no law
is violated, the status names this behaviour, which is not a failure.

Unless stated otherwise, the limits in this module were measured on 144 scenes of the full model: 710 and 3000 rpm; 1,
5, 31 and 125 kN; friction 0.02, 0.1 and 0.7; load on the rollers alone or also on the housing spring; play 0 and
0.1 mm, and interference. Solvers: imex2, ode1, ode2 and ode4 with a step of 1/61440 s (Giraudo et al. 2025), twice and
four times this step. Reference runs use imex2 with a quarter of this step.
`tests/verification/test_run_verdicts.py` counts how often the status is right on other scenes.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from functools import cache

from srbval.models.estimates import ERROR_TOLERANCE, REFINEMENT, Estimate
from srbval.models.hierarchy import level_of
from srbval.models.outputs import DEPTH_LIMIT_M
from srbval.models.run import RunStatus, RunSummary, bearing_of_run
from srbval.scene import LoadPath, RollerFit, paper_scene
from srbval.scene.parts import STANDARD_GRAVITY_M_S2
from srbval.scene.scene import describe_step

# Cage speed of a driven cage, in the cage speed of pure rolling: the limits are those of the paper's innermost and
# outermost circle alone. Outside of the range, rollers slip along all of their length. Reference runs: 31 at 0.979 or
# below, the others at 0.985 or above.
PURE_ROLLING_RANGE = (0.985, 1.026)
# With a housing spring: least share of the load that the rollers carry in static balance, and least part of this share
# that they carry in the run; below, they rattle more than they carry. The reference runs: 0.0024 and below, or 0.03
# and above; at least 0.86 of this share.
MIN_BALANCED_SHARE, MIN_PART_OF_BALANCE = 0.01, 0.5
# With a housing spring, the load counts as lost only with further evidence: the energy balance misses more than this
# share of the losses (sound runs up to 0.05, failed runs from 0.17), or no roller has contact for more than this share
# of the time (sound runs 0.0001, failed runs from 0.87).
MAX_ENERGY_GAP, MAX_IDLE_SHARE = 0.1, 0.5
CHANCE_HIDES = "chance hides the error due to the step"
CAUTION = "with caution: "  # precedes a reason for which the run's results may be wrong
MAX_COST_FACTOR = 64  # highest cost of a recommended step, in the cost of the run
MIN_CARRIED_SHARE = 0.99  # least share of the load that the rollers must carry if nothing else can
# Share of the losses that may be missing from the energy balance. At the paper's step implicit methods leave 0.05 at
# most, imex2 0.023 from 127 to 3000 rpm, 0.02 in a ramp of 300 rad/s2. Explicit ones whose friction chatters leave
# more: beyond 0.1 the 500-1500 Hz RMS of the paper's scene with interference is 1.5 to 8 times too large.
ENERGY_LIMIT, ENERGY_CAUTION = 0.1, 0.05
# Factor on `ENERGY_LIMIT` if the step's errors in cage speed, band levels and drive power are within tolerance: then
# only the energy balance is wrong. A light bearing whose friction chatters misses 10 %; its levels are within 3 %.
ACCURATE_STEP_FACTOR = 2.0
# Largest difference between the mean force on the ring and its change of momentum, in its load and weight. Reference
# runs miss up to 0.011, imex2 at the paper's step up to 0.056; at four times this step, if the rollers carry all of the
# load, imex2 misses 0.21 to 0.92, the error of the rollers' forces, and cage speeds are wrong by up to 19 %. One run of
# random scenes, at 0.14, agrees with its reference.
FORCE_LIMIT = 0.2
# Of 290 runs at steps above `step_limits.elastic_limit_s`, two were stable, at 6 % above; none at 10 % above.
STEP_LIMIT = 1.1
# Longest step, in that limit, at which a slow cage counts as real although the energy balance does not close. Up to it
# 155 runs with truly slow cages are wrong by at most 2 %, except three (4 to 8 %); imex2 from 0.84 on by up to 32 %.
SHORT_STEP_SHARE = 0.5
SLIDING = 0.01  # tolerance of the cage speed if the rollers slide or rattle


def assess(run: RunSummary) -> tuple[RunStatus, str]:
    """Status of a run, and the reason for it, with advice for the scene."""
    if (failure := _find_failure(run)) is not None:
        return failure
    status, seen = _describe_behaviour(run)
    gap = _energy_gap(run)
    if gap > ENERGY_CAUTION:
        seen.append(f"{CAUTION}{gap:.0%} of the losses have no source, so some noise is numerical; {_step_advice(run)}")
    elif abs(run.energy_imbalance) > ENERGY_CAUTION:
        seen.append(f"{abs(run.energy_imbalance):.0%} of the losses have no source at any step: a gap of the model")
    elif not math.isnan(run.energy_imbalance):
        seen.append(f"the energy balance closes within {abs(run.energy_imbalance):.1%} of the losses")
    reason, error = "; ".join(seen), run.step_error
    if error is None:
        return status, reason
    moves = status is not RunStatus.OK  # the rollers slide or rattle
    slides = [e for e in error.certain_excesses if moves and e.kind == "cage" and not e.certainly_exceeds(SLIDING)]
    beyond = [e for e in error.certain_excesses if e not in slides]
    if beyond:
        return RunStatus.INACCURATE, (
            f"{reason}; but errors due to the step of {error.step_s * 1e6:.4g} us exceed their limits: "
            f"{'; '.join(map(str, beyond))}; {_step_advice(run, beyond)}"
        )
    cautions = [f"up to {SLIDING:.0%} is accepted because rollers slide or rattle: {e}" for e in slides]
    if error.undecided_estimates:
        cautions.append(f"{CHANCE_HIDES}: {'; '.join(map(str, error.undecided_estimates))}")
    return status, f"{reason}; {'' if CAUTION in reason else CAUTION}{'; '.join(cautions)}" if cautions else reason


def _find_failure(run: RunSummary) -> tuple[RunStatus, str] | None:
    """Status and reason of a failure of the integration; None if the run did not fail."""
    scene, remedy = run.scene, _step_advice(run)
    if not run.finite:
        return RunStatus.NOT_FINITE, f"the state is no longer finite; {remedy}"
    if run.deepest_m > DEPTH_LIMIT_M:
        lighter = "reduce the load, or raise the contacts' stiffness"
        return RunStatus.TOO_DEEP, (
            f"penetration reached {run.deepest_m * 1e6:.4g} um, the contact search reaches "
            f"{DEPTH_LIMIT_M * 1e6:.0f} um; {lighter if _is_sound(run) else remedy}"
        )
    missing = abs(run.missing_n) / _carried_n(run) if scene.mean_radial_n else 0.0
    if missing > FORCE_LIMIT:
        return RunStatus.LOAD_LOST, (
            f"forces do not balance: {missing:.0%} of load and weight is missing from the mean force on the ring, the "
            f"limit is {FORCE_LIMIT:.0%}; {remedy}"
        )
    if _load_is_lost(run):
        return RunStatus.LOAD_LOST, f"{_carried_text(run)}; {remedy}"
    if not _cage_is_driven(run) and not _is_sound(run):
        return RunStatus.CAGE_LOST, (
            f"the cage turned at {run.cage_ratio:.4f} of the shaft, pure rolling is {run.rolling_ratio:.4f}, and "
            f"{_energy_gap(run):.0%} of the losses have no source; {remedy}"
        )
    vouched = run.step_error is not None and not (run.step_error.certain_excesses or run.step_error.undecided_estimates)
    gap, limit = _energy_gap(run), ENERGY_LIMIT * (ACCURATE_STEP_FACTOR if vouched else 1)
    if gap > limit and scene.speed_profile is None:
        return RunStatus.ENERGY_OPEN, (
            f"the energy balance does not close: {gap:.0%} of the losses have no source, the limit is {limit:.0%}; "
            f"friction chatters from step to step; {remedy}"
        )
    if run.step_s > STEP_LIMIT * run.step_limit_s:
        return RunStatus.STEP_TOO_LONG, (
            f"the step of {run.step_s * 1e6:.4g} us is longer than the {run.step_limit_s * 1e6:.4g} us up to which "
            f"the bouncing of a roller between the races decays; the longest step below this limit is "
            f"{_recommended_step(run)}"
        )
    return None


def _energy_gap(run: RunSummary) -> float:
    """Absolute part of the run's energy imbalance that is due to the solver step, divided by the losses.

    The whole imbalance is returned if the part is unknown or if the drive power's error may exceed its tolerance. The
    rest of an imbalance is due to the model.
    """
    error, whole = run.step_error, abs(run.energy_imbalance)
    if error is None or math.isnan(error.energy):
        return whole
    unsure = any(estimate.kind == "drive_power" for estimate in (*error.certain_excesses, *error.undecided_estimates))
    return whole if unsure else abs(error.energy)


def _carried_n(run: RunSummary) -> float:
    """Static force on the ring [N]: mean radial load, or its vector sum with the housing's weight if that is larger."""
    load = run.scene.load
    weight_n = STANDARD_GRAVITY_M_S2 * run.scene.housing.mass_kg if load.gravity else 0.0
    return max(run.scene.mean_radial_n, abs(cmath.rect(run.scene.mean_radial_n, load.direction_rad) - 1j * weight_n))


def _describe_behaviour(run: RunSummary) -> tuple[RunStatus, list[str]]:
    """Status of a run without failure, with sentences on the bearing's behaviour and on how to change it."""
    unloaded, rest = _rollers_are_unloaded(run), f"{_carried_text(run)}, the housing spring carries the rest"
    seen = [rest if run.scene.mean_radial_n else "there is no load to carry"] if unloaded else []
    bearing = bearing_of_run(run.scene) if run.scene.oil is not None else None
    if bearing is not None and bearing.ratings is not None:
        least_n, there_n = bearing.ratings.minimum_load_n(run.scene.mean_shaft_rad_s), _carried_n(run)
        least = f"the catalogue's minimum at this speed is {least_n / 1e3:.3g} kN"
        seen += [f"{CAUTION}load {there_n / 1e3:.3g} kN, {least}"] if there_n < least_n else []
    if not _cage_is_driven(run):
        slip, faster = run.cage_ratio / run.rolling_ratio - 1, (1 - run.cage_ratio) / (1 - run.rolling_ratio) - 1
        slides = (
            f"the rollers slide: the cage turned at {run.cage_ratio:.4f} of the shaft, {abs(slip):.1%} "
            f"{'below' if slip < 0 else 'above'} pure rolling ({run.rolling_ratio:.4f}); so BPFO lies {slip:+.1%} and "
            f"BPFI {faster:+.1%} from the kinematic line, and both broaden"
        )
        return RunStatus.SKIDDING, [slides, *seen, _loading_advice(run, skids=True)]
    if unloaded:
        seen += ["fault lines are due to rattling rollers, or absent", _loading_advice(run, skids=False)]
        return RunStatus.ROLLERS_UNLOADED, seen
    return RunStatus.OK, ["the cage is driven, the load is carried", *seen]


def _rollers_are_unloaded(run: RunSummary) -> bool:
    """True if the housing spring carries the load in place of the rollers, or if no load presses the rollers."""
    scene, load, contact = run.scene, run.scene.load, run.scene.contact
    beside = load.path is LoadPath.HOUSING
    if scene.mean_radial_n:
        rattle = run.roller_load_share < MIN_PART_OF_BALANCE * run.balanced_share
        return beside and (rattle or run.balanced_share < MIN_BALANCED_SHARE)
    pressed = contact.roller_fit is RollerFit.PRINTED or contact.radial_play_m < 0
    return not (scene.load_table()[2].any() or pressed or (load.gravity and not beside))


def _load_is_lost(run: RunSummary) -> bool:
    """True if the rollers carry too little of the load because of an error of the integration."""
    beside = run.scene.load.path is LoadPath.HOUSING
    if not run.scene.mean_radial_n or (beside and run.balanced_share < MIN_BALANCED_SHARE):
        return False
    missing = run.roller_load_share < (MIN_PART_OF_BALANCE * run.balanced_share if beside else MIN_CARRIED_SHARE)
    return run.idle_share > MAX_IDLE_SHARE or (missing and not _energy_gap(run) <= MAX_ENERGY_GAP)


def _cage_is_driven(run: RunSummary) -> bool:
    low, high = (share * run.rolling_ratio for share in PURE_ROLLING_RANGE)
    return not (run.cage_ratio < low or run.cage_ratio > high)


def _is_sound(run: RunSummary) -> bool:
    """True if nothing indicates that the integration failed.

    An energy gap (see `_energy_gap`) indicates a failure only at constant speed and with a step of at least half the
    longest stable step.
    """
    wild = _energy_gap(run) > ENERGY_CAUTION and not run.step_s < SHORT_STEP_SHARE * run.step_limit_s
    too_long = run.step_s > STEP_LIMIT * run.step_limit_s
    return not (run.idle_share > MAX_IDLE_SHARE or too_long or (wild and run.scene.speed_profile is None))


def _carried_text(run: RunSummary) -> str:
    return f"the rollers carry {run.roller_load_share:.2%} of the load ({run.balanced_share:.2%} in static balance)"


def _loading_advice(run: RunSummary, *, skids: bool) -> str:
    """Advice on how to load the rollers of this scene; if the cage `skids`, also to lower the speed."""
    beside = run.scene.load.path is LoadPath.HOUSING and run.scene.mean_radial_n > 0
    helps = 'load path = "bearing", less radial play, more load' if beside else "more radial load"
    return f"to load the rollers: {helps}{', less speed' if skids else ''}"


def _step_advice(run: RunSummary, beyond: Sequence[Estimate] = ()) -> str:
    """Advice on step or solver if the integration failed or is doubtful; `beyond`: estimated errors above tolerance.

    The advice never repeats the scene's setting. Errors are assumed to be proportional to the step.
    """
    error, other = run.step_error, run.scene.solver.name != default_solver()
    if level_of(run.scene.model).own_solver:
        return "take the full model"
    solver = f"take the solver {default_solver()}"
    if error is not None and error.stalled:
        return f"steps {REFINEMENT} times finer have the same errors{f': {solver}' if other else ''}"
    times = max((abs(e.error) / ERROR_TOLERANCE[e.kind] for e in beyond), default=2.0)
    if times > MAX_COST_FACTOR:
        return solver if other else f"no step is fine enough at less than {MAX_COST_FACTOR} times the cost of this run"
    step = f"a step of {_recommended_step(run, 2 ** math.ceil(math.log2(times)))}"
    return f"{solver}, or {step}" if other and run.step_s <= run.default_limit_s else f"take {step}"


def _recommended_step(run: RunSummary, times: int = 2) -> str:
    """Recommended step as text: the run's step divided by `times`, or the longest stable step for an unstable run."""
    scene, level, rate = run.scene, level_of(run.scene.model), run.scene.output_rate_hz
    steps = times * level.steps_per_output(scene)
    if run.step_s > run.step_limit_s:
        steps = math.ceil(1 / (rate * run.step_limit_s))
    return describe_step(rate * ((steps - 1) * level.coarser + 1))  # the longest step for which the level makes so many


@cache
def default_solver() -> str:
    """Name of the default solver."""
    return paper_scene().solver.name
