"""Status of a run: the bearing's behaviour or the failure of the integration, with advice.

Explicit integration fails silently, see the page "Equations of motion" of the theory, "Health of a run". The tests ask
for what any motion of the model keeps; a bearing need not drive its cage or carry the load: while they pass, skidding
and unloaded rollers are named and are no failures.

The limits are measured; unless stated otherwise, on 144 scenes of the full model (710 and 3000 rpm; 1, 5, 31 and
125 kN; friction 0.02, 0.1 and 0.7; either load path; play 0 and 0.1 mm, interference), each by imex2, ode1, ode2 and
ode4 at the paper's step, twice and four times that, and by imex2 at a quarter of it as the truth.
`tests/verification/test_run_verdicts.py` counts on other scenes how often they are right.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from functools import cache

from srbval.models.estimates import FINER, TOLERANCE, Estimate
from srbval.models.hierarchy import level_of
from srbval.models.outputs import DEEPEST_M
from srbval.models.run import RunStatus, RunSummary, bearing_of_run
from srbval.scene import LoadPath, RollerFit, paper_scene
from srbval.scene.parts import STANDARD_GRAVITY_M_S2
from srbval.scene.scene import describe_step

# In the cage speed of pure rolling: the paper's innermost and outermost circle alone. Outside, rollers slip on all of
# their length. 31 truths are at 0.979 or below, the others at 0.985 or above.
CAGE_RANGE = (0.985, 1.026)
DRIFT = 0.01  # change of the cage's speed over a run, in the speed of pure rolling, that is worth a word
# Least part of the load that rollers beside a housing spring have in static balance, and part of that share which they
# carry: below, they rattle more than they carry. The truths: 0.0024 and below, or 0.03 and above; 0.86 of it and more.
LEAST_SHARE, LEAST_PART = 0.01, 0.5
# Further evidence without which no load counts as lost beside a spring: the energy balance misses more than this share
# of the losses (sound runs up to 0.05, failed ones from 0.17), or for more than this share of the time there is no
# contact at all (sound ones 0.0001, failed ones from 0.87).
ENERGY_OPEN, IDLE_SHARE = 0.1, 0.5
CAUTION = "with caution: "  # precedes what may make a run's figures wrong
MOST_TIMES = 64  # highest cost of an advised step, in the run's cost
CARRIED = 0.99  # share of the load if the rollers alone can carry it; less needs an explanation
# Share of the losses that may be missing from the energy balance. At the paper's step implicit methods leave 0.05 at
# most, imex2 0.023 from 127 to 3000 rpm, 0.02 in a ramp of 300 rad/s2. Explicit ones whose friction chatters leave
# more: beyond 0.1 the 500-1500 Hz RMS of the paper's scene with interference is 1.5 to 8 times too large.
ENERGY_LIMIT, ENERGY_CAUTION = 0.1, 0.05
# Times that limit if the step's estimated errors in cage speed, band levels and drive power are within tolerance: only
# the account is open then. A light bearing whose friction chatters misses 10 % and has its levels within 3 %.
VOUCHED = 2.0
# Share of the load and the ring's weight by which the mean forces on the ring may miss its change of momentum. The
# truths miss up to 0.011; imex2 at the paper's step up to 0.056; at four times that, where rollers carry all, 0.21 to
# 0.92, which is how far the rollers' forces are off, and cages up to 19 %. One run of drawn scenes, at 0.14, is like
# its truth.
FORCE_LIMIT = 0.2
# Of 290 runs at steps above `step_limits.elastic_limit_s` two held, 6 % above it; 10 % above, none did.
STEP_LIMIT = 1.1
# Longest step, in that limit, at which a slow cage is believed although the energy balance is open. Up to it 155 runs
# of cages that are slow in truth are off by at most 2 %, except three (4 to 8 %); imex2 from 0.84 on by up to 32 %.
SHORT = 0.5
SLIDING = 0.01  # tolerance of the speed of a cage that slides or rattles, which is stated to a per cent


def assess(run: RunSummary) -> tuple[RunStatus, str]:
    """Status of a run by its figures, and its reason with advice for this scene."""
    failure = _failure(run)
    if failure is not None:
        return failure
    status, seen = _behaviour(run)
    gap = abs(_energy_gap(run))
    if gap > ENERGY_CAUTION:
        seen.append(
            f"{CAUTION}{gap:.0%} of the losses have no source, so part of the noise is numerical; {_remedy(run)}"
        )
    elif abs(run.energy_imbalance) > ENERGY_CAUTION:
        seen.append(
            f"{abs(run.energy_imbalance):.0%} of the losses have no source, with finer steps as well: the model leaves "
            "it out"
        )
    elif not math.isnan(run.energy_imbalance):
        seen.append(f"energy closes to {abs(run.energy_imbalance):.1%} of the losses")
    reason, error = "; ".join(seen), run.step_error
    if error is None:
        return status, reason
    slides = [
        e for e in error.certain if status is not RunStatus.OK and e.kind == "cage" and not e.certainly_beyond(SLIDING)
    ]
    beyond = [e for e in error.certain if e not in slides]
    if beyond:
        return RunStatus.INACCURATE, (
            f"{reason}; but the step of {error.step_s * 1e6:.4g} us leaves errors beyond the limits: "
            f"{'; '.join(map(str, beyond))}; {_remedy(run, beyond)}"
        )
    if error.open or slides:
        grows = ", more the longer the cage's speed changes" if _drifts(run) else ""
        cautions = [f"of rollers that slide or rattle, which may be off by {SLIDING:.0%}: {e}{grows}" for e in slides]
        if error.open:
            cautions.append(f"the step's error is not established: {'; '.join(map(str, error.open))}")
        return status, f"{reason}; {'' if CAUTION in reason else CAUTION}{'; '.join(cautions)}"
    return status, reason


def _failure(run: RunSummary) -> tuple[RunStatus, str] | None:
    """Status and reason of a failure, which no motion of the model shows; None if there is none."""
    scene, remedy = run.scene, _remedy(run)
    if not run.finite:
        return RunStatus.NOT_FINITE, f"the state is no longer finite; {remedy}"
    if run.deepest_m > DEEPEST_M:
        lighter = "reduce the load, or raise the contacts' stiffness"
        return RunStatus.TOO_DEEP, (
            f"penetration reached {run.deepest_m * 1e6:.4g} um, the contact search reaches "
            f"{DEEPEST_M * 1e6:.0f} um; {lighter if _sound(run) else remedy}"
        )
    missing = abs(run.missing_n) / _carried_n(run) if scene.mean_radial_n else 0.0
    if missing > FORCE_LIMIT:
        return RunStatus.LOAD_LOST, (
            f"forces do not balance: the ring's motion misses {missing:.0%} of load and weight, the limit is "
            f"{FORCE_LIMIT:.0%}; {remedy}"
        )
    if _load_lost(run):
        return RunStatus.LOAD_LOST, f"{_carried(run)}; {remedy}"
    if not _driven(run) and not _sound(run):
        return RunStatus.CAGE_LOST, (
            f"the cage turned at {run.cage_ratio:.4f} of the shaft, pure rolling is {run.rolling_ratio:.4f}, and "
            f"{abs(_energy_gap(run)):.0%} of the losses have no source; {remedy}"
        )
    vouched = run.step_error is not None and not (run.step_error.certain or run.step_error.open)
    gap, limit = abs(_energy_gap(run)), ENERGY_LIMIT * (VOUCHED if vouched else 1)
    if gap > limit and scene.speed_profile is None:
        return RunStatus.ENERGY_OPEN, (
            f"energy does not close: {gap:.0%} of the losses have no source, the limit is {limit:.0%}; friction "
            f"chatters from step to step; {remedy}"
        )
    if run.step_s > STEP_LIMIT * run.step_limit_s:
        return RunStatus.STEP_TOO_LONG, (
            f"the step of {run.step_s * 1e6:.4g} us is longer than the {run.step_limit_s * 1e6:.4g} us up to which "
            f"a roller's bouncing between the races decays; the longest step below that is {_finer(run)} (--dt)"
        )
    return None


def _energy_gap(run: RunSummary) -> float:
    """Share of the losses whose source is lost by the step.

    If the drive's power is known to be right, finer steps would close this share; continuous contacts leave out couples
    of friction and damping within a patch, but not their power.
    """
    error = run.step_error
    if error is None or math.isnan(error.energy):
        return run.energy_imbalance
    unsure = any(estimate.kind == "drive_power" for estimate in (*error.certain, *error.open))
    return run.energy_imbalance if unsure else error.energy


def _carried_n(run: RunSummary) -> float:
    """Force that presses the ring down: the mean radial load, with the weight of the ring if that is more."""
    load = run.scene.load
    weight_n = STANDARD_GRAVITY_M_S2 * run.scene.housing.mass_kg if load.gravity else 0.0
    return max(run.scene.mean_radial_n, abs(cmath.rect(run.scene.mean_radial_n, load.direction_rad) - 1j * weight_n))


def _behaviour(run: RunSummary) -> tuple[RunStatus, list[str]]:
    """Status by the bearing's behaviour, and its description with what would change it."""
    unloaded, seen = _unloaded(run), []
    if unloaded:
        rest = f"{_carried(run)}, the housing spring the rest"
        seen = [rest if run.scene.mean_radial_n else "there is no load to carry"]
    seen += _light_load(run)
    if not _driven(run):
        return RunStatus.SKIDDING, [_slip_text(run), *seen, _relief(run, skids=True)]
    if unloaded:
        seen += ["fault lines come from rollers that rattle, or are absent", _relief(run, skids=False)]
        return RunStatus.ROLLERS_UNLOADED, seen
    return RunStatus.OK, ["the cage is driven, the load is carried", *seen]


def _light_load(run: RunSummary) -> list[str]:
    """Warning if a bearing in oil carries less than its catalogue requires at this speed."""
    bearing = bearing_of_run(run.scene) if run.scene.oil is not None else None
    if bearing is None or bearing.ratings is None:
        return []
    least_n, there_n = bearing.ratings.minimum_load_n(run.scene.mean_shaft_rad_s), _carried_n(run)
    if there_n >= least_n:
        return []
    return [f"{CAUTION}{there_n / 1e3:.3g} kN, the catalogue's minimum at this speed is {least_n / 1e3:.3g} kN"]


def _slip_text(run: RunSummary) -> str:
    slip, faster = run.cage_ratio / run.rolling_ratio - 1, (1 - run.cage_ratio) / (1 - run.rolling_ratio) - 1
    (first, last), drifts = run.cage_course, _drifts(run)
    return (
        f"the rollers slide: the cage turned at {run.cage_ratio:.4f} of the shaft, {abs(slip):.1%} "
        f"{'below' if slip < 0 else 'above'} pure rolling ({run.rolling_ratio:.4f})"
        + (f", {first:.4f} at the start and {last:.4f} at the end" if drifts else "")
        + f"; so BPFO lies {slip:+.1%} and BPFI {faster:+.1%} from the kinematic line"
        + f", and both {'drift and ' if drifts else ''}broaden"
    )


def _drifts(run: RunSummary) -> bool:
    """True if the cage's speed changes: over 1 s an error of 0.1 % in the piece's mean speed became 1.7 %."""
    first, last = run.cage_course
    return run.scene.speed_profile is None and abs(last - first) > DRIFT * run.rolling_ratio


def _unloaded(run: RunSummary) -> bool:
    """True if the load bypasses the rollers, or no load presses them."""
    scene, load, contact = run.scene, run.scene.load, run.scene.contact
    beside = load.path is LoadPath.HOUSING
    if scene.mean_radial_n:
        return beside and (run.balanced_share < LEAST_SHARE or run.roller_load_share < LEAST_PART * run.balanced_share)
    axial = load.axial_n or (scene.load_profile is not None and any(scene.load_profile.axial_n))
    pressed = contact.roller_fit is RollerFit.PRINTED or contact.radial_play_m < 0
    return not (axial or pressed or (load.gravity and not beside))


def _load_lost(run: RunSummary) -> bool:
    """True if the rollers carry less than they should, with evidence that the integration caused it."""
    beside = run.scene.load.path is LoadPath.HOUSING
    if not run.scene.mean_radial_n or (beside and run.balanced_share < LEAST_SHARE):
        return False
    missing = run.roller_load_share < (LEAST_PART * run.balanced_share if beside else CARRIED)
    return run.idle_share > IDLE_SHARE or (missing and not abs(_energy_gap(run)) <= ENERGY_OPEN)


def _driven(run: RunSummary) -> bool:
    low, high = (share * run.rolling_ratio for share in CAGE_RANGE)
    return not (run.cage_ratio < low or run.cage_ratio > high)


def _sound(run: RunSummary) -> bool:
    """True if the integration shows no failure; energy may be open in a speed ramp, and if steps are short."""
    wild = abs(_energy_gap(run)) > ENERGY_CAUTION and not run.step_s < SHORT * run.step_limit_s
    too_long = run.step_s > STEP_LIMIT * run.step_limit_s
    return not (run.idle_share > IDLE_SHARE or too_long or (wild and run.scene.speed_profile is None))


def _carried(run: RunSummary) -> str:
    return f"the rollers carry {run.roller_load_share:.2%} of the load ({run.balanced_share:.2%} in static balance)"


def _relief(run: RunSummary, *, skids: bool) -> str:
    """Advice that puts load on the rollers of this scene, or takes speed from them."""
    scene = run.scene
    loose = scene.contact.roller_fit is RollerFit.PLAY and scene.contact.radial_play_m > 0
    less_play = f"a radial play below {scene.contact.radial_play_m * 1e6:.4g} um"
    beside = scene.load.path is LoadPath.HOUSING and scene.mean_radial_n > 0
    helps = ['load path = "bearing"', less_play if loose else "more load"] if beside else ["more radial load"]
    return f"to load the rollers: {', '.join(helps)}{', less speed' if skids else ''}"


def _remedy(run: RunSummary, beyond: Sequence[Estimate] = ()) -> str:
    """Advice against a failure of the integration, or errors `beyond` their limits.

    It never names a setting that the scene has or that gains nothing. Errors fall at least as the step.
    """
    error, other = run.step_error, run.scene.solver.name != default_solver()
    if level_of(run.scene.model).own_solver:
        return "take the full model (--model full)"
    solver = f"take the solver {default_solver()} (--solver)"
    if error is not None and error.stalled:
        return f"steps {FINER} times finer have the same errors{f': {solver}' if other else ''}"
    times = max((abs(e.error) / TOLERANCE[e.kind] for e in beyond), default=2.0)
    if times > MOST_TIMES:
        return solver if other else f"no step at less than {MOST_TIMES} times the cost would do"
    step = f"a step of {_finer(run, 2 ** math.ceil(math.log2(times)))} (--dt)"
    return f"{solver}, or {step}" if other and run.step_s <= run.default_limit_s else f"take {step}"


def _finer(run: RunSummary, times: int = 2) -> str:
    """Step to recommend: the longest that the contacts allow, or a `times` finer one if they allow the present step."""
    scene, level, rate = run.scene, level_of(run.scene.model), run.scene.output_rate_hz
    steps = times * level.steps_per_output(scene)
    if run.step_s > run.step_limit_s:
        steps = math.ceil(1 / (rate * run.step_limit_s))
    return describe_step(rate * ((steps - 1) * level.coarser + 1))  # the longest that the level makes so many steps of


@cache
def default_solver() -> str:
    """Name of the solver that a scene has by default."""
    return paper_scene().solver.name
