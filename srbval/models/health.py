"""Is a run a bearing? Cheap tests for failures that leave no NaN behind.

When explicit integration fails it does so silently: rollers are thrown clear, the acceleration is exactly zero and
the cage stops. So what is tested is what a bearing must do: stay finite, stay within the contact geometry, turn its
cage, carry its load, lose no more energy than goes in, and
follow its stiffest contacts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from srbval.models.run import RunStatus
from srbval.scene import LoadPath, Scene

# Of the cage speed of pure rolling. The paper's innermost and outermost circle alone give 0.985 and 1.026 of it; a cage
# outside this wider range is not driven by its rollers.
CAGE_RANGE = (0.88, 1.12)
# The load counts as lost where the rollers carry less than this part of what static balance gives them. Beside the
# housing spring rattling, bumps and, at 3000 rpm, inertia shift the share by up to a third; without it all of the load
# must go through them.
LEAST_PART = {LoadPath.HOUSING: 0.5, LoadPath.BEARING: 0.99}
# With enough play the spring carries everything and there is nothing to lose.
NOTHING_TO_LOSE = 0.001
# Share of the losses that may be missing from the energy's books. Where friction chatters, its power is counted at
# states the rollers are never long in: beyond this, nearly all of it. Converged runs close to a few per cent, not in
# a fast speed ramp (0.9 seen at 300 rad/s2), where the drive's torque is read at lagging velocities: only a caution.
ENERGY_LIMIT, ENERGY_CAUTION = 0.9, 0.3
# Of 290 runs at steps above `step_limit.elastic_limit_s` two held, 6 % above it; 10 % above, none did.
STEP_LIMIT = 1.1
ADVICE = "take the default solver, or a smaller step (--dt)"


@dataclass(frozen=True, kw_only=True)
class Signs:
    """What a run is judged by: means over the run, the deepest penetration and how deep the contact search reaches.

    `rolling_ratio` is the cage ratio of pure rolling; `balanced_share` of the load is what the rollers carry in static
    balance; `energy_imbalance`: see `account.Ledger`; `step_limit_s`: see `step_limit.elastic_limit_s`. What a model
    does not have is NaN and passes.
    """

    finite: bool
    deepest_m: float
    limit_m: float
    cage_ratio: float
    rolling_ratio: float
    load_share: float
    balanced_share: float
    energy_imbalance: float
    step_s: float = math.nan
    step_limit_s: float = math.nan


def judge(scene: Scene, signs: Signs) -> tuple[RunStatus, str]:
    """Status of a run and the reason for it, with advice where it failed."""
    if not signs.finite:
        return RunStatus.NOT_FINITE, f"the state is no longer finite; {ADVICE}"
    if signs.deepest_m > signs.limit_m:
        return RunStatus.TOO_DEEP, (
            f"penetration reached {signs.deepest_m * 1e6:.4g} um, the contact search reaches "
            f"{signs.limit_m * 1e6:.0f} um; reduce the load, raise the stiffness, or {ADVICE}"
        )
    low, high = (share * signs.rolling_ratio for share in CAGE_RANGE)
    if not low <= signs.cage_ratio <= high:
        return RunStatus.CAGE_LOST, (
            f"the cage turned at {signs.cage_ratio:.4f} of the shaft, a driven one stays within {low:.3g} to "
            f"{high:.3g}; {ADVICE}"
        )
    least = LEAST_PART[scene.load.path] * signs.balanced_share
    if scene.mean_radial_n > 0 and signs.balanced_share > NOTHING_TO_LOSE and signs.load_share < least:
        return RunStatus.LOAD_LOST, (
            f"the rollers carry {signs.load_share:.2%} of the load, static balance gives them "
            f"{signs.balanced_share:.2%}; {ADVICE}"
        )
    if abs(signs.energy_imbalance) > ENERGY_LIMIT and scene.speed_profile is None:
        return RunStatus.ENERGY_OPEN, (
            f"energy does not close: {abs(signs.energy_imbalance):.0%} of the losses have no source, the limit is "
            f"{ENERGY_LIMIT:.0%}; friction chatters from step to step; {ADVICE}"
        )
    if signs.step_s > STEP_LIMIT * signs.step_limit_s:
        return RunStatus.STEP_TOO_LONG, (
            f"the step of {signs.step_s * 1e6:.4g} us is longer than the {signs.step_limit_s * 1e6:.4g} us up to which "
            f"a roller's bouncing between the races decays; {ADVICE}"
        )
    if abs(signs.energy_imbalance) > ENERGY_CAUTION:
        return RunStatus.OK, (
            f"the cage is driven and the load is carried; with caution: {abs(signs.energy_imbalance):.0%} of the "
            "losses have no source, so part of the noise is numerical; a smaller step (--dt) shows how much"
        )
    return RunStatus.OK, "the cage is driven, the load is carried" + (
        ""
        if math.isnan(signs.energy_imbalance)
        else f", energy closes to {abs(signs.energy_imbalance):.1%} of the losses"
    )
