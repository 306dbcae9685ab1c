"""Does a run behave like a bearing? Cheap tests for failures that leave no NaN behind.

When explicit integration fails it does so silently: rollers are thrown clear, the acceleration is exactly zero and
the cage stops. So what is tested is what a bearing must do: stay finite, stay within the contact geometry, drive its
cage, carry its load, dissipate no more energy than is supplied, and resolve its stiffest contacts in time.
"""

import math
from dataclasses import dataclass

from srbval.models.run import RunStatus
from srbval.scene import LoadPath, Scene

# Of the cage speed of pure rolling. The paper's innermost and outermost circle alone give 0.985 and 1.026 of it; a cage
# outside this wider range is not driven by its rollers.
CAGE_RANGE = (0.88, 1.12)
# Part of what static balance gives the rollers that they are expected to carry: all of it where nothing else can.
LEAST_PART = {LoadPath.HOUSING: 0.5, LoadPath.BEARING: 0.99}
# Beside the housing spring rattling shifts their force by a kilonewton or two, which is much of a light load's share:
# four methods agree that at 457 rpm and 62.4 kN rollers with play carry 0.43 of it, at 997 rpm and 31.2 kN less than
# nothing. So there the load counts as lost only on further evidence of failure: the energy balance misses more than
# this share of the losses (sound runs up to 0.36, failed ones from 0.54), or for more than this share of the time there
# is no contact at all (sound ones 0.0001, failed ones from 0.87).
ENERGY_OPEN, IDLE_SHARE = 0.45, 0.5
# With enough play the spring carries everything and there is nothing to lose.
NOTHING_TO_LOSE = 0.001
# Share of the losses that may be missing from the energy balance. Where friction chatters, its power is counted at
# states the rollers are never long in: beyond this, nearly all of it. Converged runs close to a few per cent, not in
# a fast speed ramp (0.9 seen at 300 rad/s2), where the drive's torque is read at lagging velocities: only a caution.
ENERGY_LIMIT, ENERGY_CAUTION = 0.9, 0.3
# Of 290 runs at steps above `step_limit.elastic_limit_s` two held, 6 % above it; 10 % above, none did.
STEP_LIMIT = 1.1
ADVICE = "take the default solver, or a smaller step (--dt)"


@dataclass(frozen=True, kw_only=True)
class HealthIndicators:
    """What a run is assessed by: means over the run, deepest penetration, depth that the contact search covers.

    `rolling_ratio` is the cage ratio of pure rolling; `balanced_share` of the load is what the rollers carry in static
    balance; `energy_imbalance`: see `run_statistics.EnergyBalance`; `idle_share`: share of the time without contact;
    `step_limit_s`: see `step_limit.elastic_limit_s`. What a model does not have is NaN and passes.
    """

    finite: bool
    deepest_m: float
    limit_m: float
    cage_ratio: float
    rolling_ratio: float
    load_share: float
    balanced_share: float
    energy_imbalance: float
    idle_share: float = 0.0
    step_s: float = math.nan
    step_limit_s: float = math.nan


def assess(scene: Scene, run: HealthIndicators) -> tuple[RunStatus, str]:
    """Status of a run and the reason for it, with advice where it failed."""
    if not run.finite:
        return RunStatus.NOT_FINITE, f"the state is no longer finite; {ADVICE}"
    if run.deepest_m > run.limit_m:
        return RunStatus.TOO_DEEP, (
            f"penetration reached {run.deepest_m * 1e6:.4g} um, the contact search reaches "
            f"{run.limit_m * 1e6:.0f} um; reduce the load, raise the stiffness, or {ADVICE}"
        )
    low, high = (share * run.rolling_ratio for share in CAGE_RANGE)
    if not low <= run.cage_ratio <= high:
        return RunStatus.CAGE_LOST, (
            f"the cage turned at {run.cage_ratio:.4f} of the shaft, a driven one stays within {low:.3g} to "
            f"{high:.3g}; {ADVICE}"
        )
    carried = f"the rollers carry {run.load_share:.2%} of the load, {run.balanced_share:.2%} in static balance"
    unloaded = _unloaded(scene, run)
    if unloaded and _beyond_rattling(scene, run):
        return RunStatus.LOAD_LOST, f"{carried}; {ADVICE}"
    if abs(run.energy_imbalance) > ENERGY_LIMIT and scene.speed_profile is None:
        return RunStatus.ENERGY_OPEN, (
            f"energy does not close: {abs(run.energy_imbalance):.0%} of the losses have no source, the limit is "
            f"{ENERGY_LIMIT:.0%}; friction chatters from step to step; {ADVICE}"
        )
    if run.step_s > STEP_LIMIT * run.step_limit_s:
        return RunStatus.STEP_TOO_LONG, (
            f"the step of {run.step_s * 1e6:.4g} us is longer than the {run.step_limit_s * 1e6:.4g} us up to which "
            f"a roller's bouncing between the races decays; {ADVICE}"
        )
    seen = ["the cage is driven"] + ([] if unloaded else ["the load is carried"])
    cautions = [f"{carried}: they rattle more than they carry"] if unloaded else []
    if abs(run.energy_imbalance) > ENERGY_CAUTION:
        cautions.append(
            f"{abs(run.energy_imbalance):.0%} of the losses have no source, so part of the noise is numerical; a "
            "smaller step (--dt) shows how much"
        )
    elif not math.isnan(run.energy_imbalance):
        seen.append(f"energy closes to {abs(run.energy_imbalance):.1%} of the losses")
    return RunStatus.OK, ", ".join(seen) + (f"; with caution: {'; '.join(cautions)}" if cautions else "")


def _unloaded(scene: Scene, run: HealthIndicators) -> bool:
    """Whether the rollers carry less than is expected of them."""
    something = scene.mean_radial_n > 0 and run.balanced_share > NOTHING_TO_LOSE
    return something and run.load_share < LEAST_PART[scene.load.path] * run.balanced_share


def _beyond_rattling(scene: Scene, run: HealthIndicators) -> bool:
    """Whether rattling beside the housing spring cannot be why."""
    if scene.load.path is not LoadPath.HOUSING or math.isnan(run.energy_imbalance):
        return True
    return abs(run.energy_imbalance) > ENERGY_OPEN or run.idle_share > IDLE_SHARE
