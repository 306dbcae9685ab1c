"""Is a run a bearing? Cheap tests for failures that leave no NaN behind.

When explicit integration fails it does so silently: rollers are thrown clear, the acceleration is exactly zero and
the cage stops. So what is tested is what a bearing must do: stay finite, stay within the contact geometry,
turn its cage, carry its load.
"""

from __future__ import annotations

from srbval.models.run import RunStatus
from srbval.scene import LoadPath, Scene

# Pure rolling at the innermost and outermost circle alone gives 0.424 and 0.442 of the shaft; a cage outside
# this wider range is not driven by its rollers.
CAGE_RATIO_RANGE = (0.38, 0.48)
# The load counts as lost where the rollers carry less than this part of what static balance gives them. Beside the
# housing spring rattling and bumps shift the share by a tenth; without it all of the load must go through them.
LEAST_PART = {LoadPath.HOUSING: 0.2, LoadPath.BEARING: 0.99}
# With enough play the spring carries everything and there is nothing to lose.
NOTHING_TO_LOSE = 0.001
ADVICE = "take a smaller step (--dt) or a higher-order solver"


def judge(
    scene: Scene,
    cage_ratio: float,
    load_share: float,
    balanced_share: float,
    deepest_m: float,
    limit_m: float,
    finite: bool,
) -> tuple[RunStatus, str]:
    """Status and reason of a run: its cage speed, load share and that in static balance, deepest penetration [m]."""
    if not finite:
        return RunStatus.NOT_FINITE, f"the state is no longer finite; {ADVICE}"
    if deepest_m > limit_m:
        return RunStatus.TOO_DEEP, (
            f"penetration reached {deepest_m * 1e6:.1f} um, the contact search reaches {limit_m * 1e6:.0f} um; "
            f"reduce the load, raise the stiffness, or {ADVICE}"
        )
    low, high = CAGE_RATIO_RANGE
    if not low <= cage_ratio <= high:
        return RunStatus.CAGE_LOST, (
            f"the cage turned at {cage_ratio:.4f} of the shaft, a driven one stays within {low} to {high}; {ADVICE}"
        )
    least = LEAST_PART[scene.load.path] * balanced_share
    if scene.mean_radial_n > 0 and balanced_share > NOTHING_TO_LOSE and load_share < least:
        return RunStatus.LOAD_LOST, (
            f"the rollers carry {load_share:.2%} of the load, static balance gives them {balanced_share:.2%}; {ADVICE}"
        )
    return RunStatus.OK, "the cage is driven and the load is carried"
