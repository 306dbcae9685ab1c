"""A small map from end to end: planted failures are caught by the runs, converged ones are not flagged."""

import json
import math
import statistics
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from srbval.cli import main
from srbval.errors import ConfigurationError
from srbval.models.full.parameters import Parameters
from srbval.models.full.steps import take_steps
from srbval.models.full_run import without_friction
from srbval.models.solvers import METHODS, Method
from srbval.models.solvers.linear_stability import (
    Linear,
    explicit_limit,
    longest_step,
    spectral_radius,
    stability_function,
    step_map,
)
from srbval.models.step_error import BLOCKS, KINDS, TOLERANCE
from srbval.scene import load_scene, paper_scene
from srbval.storage.json_files import to_json
from srbval.studies import outcomes as outcome_module
from srbval.studies.outcomes import RunOutcome, outcome_store
from srbval.studies.scenes import PAPER_STEP_S
from srbval.studies.stability.cell import (
    CAGE_LIMIT,
    LOAD_RANGE,
    PLANTED,
    PLANTED_RPM,
    UNLIKE,
    StabilityCell,
    planted_in,
)
from srbval.studies.stability.claims import claims
from srbval.studies.stability.grid import FULL, RIG, StabilityCase, StabilityGrid, StabilityGroup
from srbval.studies.stability.reference import StabilityReference
from srbval.studies.stability.step_limits import StepLimits, balanced, linearise
from srbval.studies.stability.study import StabilityResult, run_stability

# The planted failures at both critical velocities, with references cheaper than the real map's.
PLANTED_GRID = replace(
    FULL, scenes=("play0-outer",), solvers=("ode1", "ode2"), steps_per_s=(30720, 15360), rpm=PLANTED_RPM,
    reference_steps_per_s=245760,
)  # fmt: skip
CONVERGED = 1e-4  # cage speed at twice the reference's step: a hundredth of the limit for cells
ROUNDING = 1e-6  # samples
CELL_KEYS = {"model", "solver", "dt_s", "rpm", "status", "reason", "predicted_limit_dt_s"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("stability")


@pytest.fixture(scope="module")
def result(folder: Path) -> StabilityResult:
    return run_stability(PLANTED_GRID, store=replace(outcome_store(), folder=folder))


def test_every_planted_failure_is_caught_by_the_run_itself(result: StabilityResult) -> None:
    assert len(result.planted) == len(PLANTED) * len(PLANTED_RPM) * len(PLANTED_GRID.critical_velocity_m_s)
    assert [p for p in result.planted if not p.caught] == []


def test_no_converged_run_is_flagged(result: StabilityResult) -> None:
    assert [r.fine.reason for r in result.references if r.flagged] == []
    assert all(r.own_cage_error < CONVERGED for r in result.references)
    assert result.sound


def test_what_is_ok_is_like_the_converged_run(result: StabilityResult) -> None:
    for cell in result.cells:
        assert not cell.ok or (cell.cage_error <= CAGE_LIMIT and cell.load_part >= LOAD_RANGE[0])
        assert cell.ok or cell.reason


def test_document(result: StabilityResult) -> None:
    document = to_json(result)
    assert all(set(cell) >= CELL_KEYS for cell in document["cells"])
    counts = document["counts"]
    assert counts["cells"] == 16
    found = ("ok", "inaccurate", "caught_by_the_run", "seen_by_comparison_only")
    assert counts["cells"] == sum(counts[name] for name in found)
    assert {cell["critical_velocity_m_s"] for cell in document["cells"]} == {0.001, 0.5}


def test_what_was_run_is_not_run_again(result: StabilityResult, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any, **__: Any) -> None:
        raise AssertionError("a stored run was made again")

    monkeypatch.setattr(outcome_module, "run_all", refuse)
    again = run_stability(PLANTED_GRID, store=replace(outcome_store(), folder=folder))
    assert [c.to_dict() for c in again.cells] == [c.to_dict() for c in result.cells]


def test_an_interrupted_map_continues(result: StabilityResult, folder: Path, tmp_path: Path) -> None:
    stored = sorted(folder.glob("*.json"))
    for path in stored[: len(stored) // 2]:
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / stored[-1].name).write_text("{}", encoding="utf-8")
    again = run_stability(PLANTED_GRID, store=replace(outcome_store(), folder=tmp_path))
    assert [c.status for c in again.cells] == [c.status for c in result.cells]
    assert len(list(tmp_path.glob("*.json"))) == len(stored)


def test_default_solver_and_the_paper_s_step_are_in_the_map() -> None:
    scene = paper_scene()
    assert scene.solver.name in FULL.solvers
    assert round(1 / PAPER_STEP_S) in FULL.steps_per_s
    assert round(1 / scene.solver.step_s) in FULL.steps_per_s


def test_runs_of_a_group_have_one_length_whatever_their_step() -> None:
    lengths = {(s.duration_s, s.settle_s) for s in (FULL.scene(c) for c in FULL.cases if c.group.rpm == 127.0)}
    assert len(lengths) == 1
    for case in FULL.cases:
        samples = FULL.scene(case).duration_s * FULL.scene(case).output_rate_hz
        assert samples == pytest.approx(round(samples), abs=ROUNDING)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"scenes": ("nowhere",)}, "nowhere"),
        ({"solvers": ("ode9",)}, "ode9"),
        ({"rpm": (-1.0,)}, "rpm"),
        ({"steps_per_s": (0,)}, "steps-per-s"),
    ],
)
def test_a_wrong_grid_is_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        replace(FULL, **changes)


def test_command(
    result: StabilityResult, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[StabilityGrid] = []

    def made(grid: StabilityGrid, **_: Any) -> StabilityResult:
        asked.append(grid)
        return result

    monkeypatch.setattr("srbval.studies.stability.study.run_stability", made)
    assert main(["stability", "--quick", "--rpm", "710", "3000", "--json", "-o", str(tmp_path / "s.json")]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["kind"], len(document["cells"])) == ("stability", 16)
    assert asked[0].rpm == (710.0, 3000.0)
    kept = json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))
    assert kept["made_utc"] == document["made_utc"]
    assert {"processor", "usable_cores"} <= set(kept["machine"])
    assert main(["stability", "--quick"]) == 0
    said = capsys.readouterr().out
    assert "planted failures caught by the runs themselves: 12 of 12" in said
    assert "too-deep" in said


def test_command_says_what_it_does_not_know(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stability", "--solvers", "ode9"]) == 2
    assert "ode4" in capsys.readouterr().err


def outcome(**changes: Any) -> RunOutcome:
    given: dict[str, Any] = {
        "status": "ok", "reason": "well", "cage_ratio": 0.4314, "load_share": 0.06, "band_rms_m_s2": 1.0,
        "energy_imbalance": 0.0, "seconds": 0.2, "settle_s": 0.02, "wall_s": 0.1,
    }  # fmt: skip
    return RunOutcome(**given | changes)


def cell(
    *,
    solver: str = "ode4",
    steps_per_s: int = 61440,
    rpm: float = 710.0,
    converged: RunOutcome | None = None,
    **own: Any,
) -> StabilityCell:
    group = StabilityGroup(scene="play0-outer", rpm=rpm, critical_velocity_m_s=0.001)
    right = converged or outcome()
    return StabilityCell(
        case=StabilityCase(group=group, solver=solver, steps_per_s=steps_per_s),
        model="full",
        outcome=outcome(**own),
        reference=StabilityReference(
            group=group, solver="imex2", steps_per_s=983040, fine=right, coarse=right
        ),
        limits=StepLimits(whole_s=1e-7, elastic_s=1e-4),
        points_per_step=0.2,
    )  # fmt: skip


def test_a_run_like_the_converged_one_is_ok() -> None:
    good = cell(cage_ratio=0.4314 * 1.009, load_share=0.06 * 0.96)
    assert (good.status, good.reason, good.ok, good.stable) == ("ok", "well", True, True)


@pytest.mark.parametrize(
    ("name", "change"), [("mean cage speed", 1e-4), ("RMS in 500-1500 Hz", 0.2), ("drive power", -0.1)]
)
def test_what_is_beyond_a_tolerance_is_inaccurate_and_still_stable(name: str, change: float) -> None:
    means = {"mean cage speed": 30.0, "RMS in 500-1500 Hz": 4.0, "drive power": 7e3}
    right = outcome(means={of: [mean] * BLOCKS for of, mean in means.items()})
    for off, status in ((change, "inaccurate"), (0.01 * change, "ok")):
        wrong = {of: [mean * (1 + off) if of == name else mean] * BLOCKS for of, mean in means.items()}
        found = cell(converged=right, means=wrong)
        assert (found.status, found.ok, found.stable) == (status, status == "ok", True)
    both = {"means": {name: [1.0 + change] * BLOCKS}, "status": "skidding"}
    theirs = outcome(means={name: [1.0] * BLOCKS}, status="skidding")
    assert cell(converged=theirs, **both).ok == (name == "mean cage speed"), "one that slides is told to a per cent"
    chance = [times * means[name] for _ in range(BLOCKS // 4) for times in (0.0, 0.0, 2.4, 2.4)]
    assert cell(converged=right, means={name: chance}).ok, "blocks that say so different things say nothing"


@pytest.mark.parametrize(
    "wrong",
    [
        {"cage_ratio": 0.4314 * 1.011},
        {"cage_ratio": 0.4314 * 0.989},
        {"load_share": 0.06 * 0.94},
        {"load_share": 0.06 * 1.11},
        {"load_share": math.nan},
        {"cage_ratio": math.nan},
    ],
)
def test_what_the_comparison_alone_sees_has_a_word_of_its_own(wrong: dict[str, float]) -> None:
    silent = cell(**wrong)
    assert silent.outcome.ok
    assert silent.status == UNLIKE
    assert "own tests passed" in silent.reason
    assert not silent.stable


def test_a_slow_cage_that_the_converged_run_has_too_is_no_failure() -> None:
    slow = {"status": "skidding", "cage_ratio": 0.36, "load_share": 1e-4}
    both = cell(converged=outcome(**slow), **(slow | {"load_share": -2e-4}))
    assert (both.status, both.ok, both.stable, both.reference.flagged) == ("skidding", True, True, False)
    alone = cell(**slow)
    assert (alone.status, alone.stable) == (UNLIKE, False)
    assert cell(converged=outcome(**slow)).status == UNLIKE


def test_the_run_s_own_word_comes_first() -> None:
    lost = cell(status="load-lost", reason="the rollers carry 0 %", load_share=0.0)
    assert (lost.status, lost.reason, lost.stable) == ("load-lost", "the rollers carry 0 %", False)


def test_energy_that_does_not_close_is_not_ok_but_may_be_stable() -> None:
    chatters = cell(status="energy-open", reason="energy")
    assert (chatters.status, chatters.ok, chatters.stable) == ("energy-open", False, True)
    assert not cell(status="energy-open", reason="energy", load_share=0.03).stable


def test_nothing_is_ok_beside_a_failed_reference() -> None:
    assert cell(converged=outcome(status="too-deep")).status == "no-reference"


def test_planted_failures_are_found_by_solver_step_and_speed() -> None:
    cells = [
        cell(solver="ode1", steps_per_s=30720, status="too-deep"),
        cell(solver="ode2", steps_per_s=15360),
        cell(solver="ode2", steps_per_s=30720, status="too-deep"),
        cell(solver="ode1", steps_per_s=30720, rpm=355.0, status="too-deep"),
    ]
    assert [p.caught for p in planted_in(cells)] == [True, False]


def grid(bad: dict[tuple[str, float], str]) -> list[StabilityCell]:
    return [
        cell(solver=solver, rpm=rpm, status=bad.get((solver, rpm), "ok"))
        for solver in ("ode1", "ode2", "ode3", "ode4")
        for rpm in (710.0, 3000.0)
    ]


def test_the_lowest_order_is_counted() -> None:
    order, _ = claims(grid({("ode1", 710.0): "load-lost"}))
    assert order.borne_out is False
    assert order.answer.startswith(
        "No: the lowest order that is stable in every cell at 1/61440 s up to 1000 rpm is ode2"
    )
    assert any("load-lost at 710 rpm" in line for line in order.evidence)
    lower = {(f"ode{n}", 710.0): "too-deep" for n in (1, 2, 3)}
    assert claims(grid(lower))[0].borne_out is True
    assert claims(grid({**lower, ("ode4", 710.0): "too-deep"}))[0].borne_out is False


def test_what_fails_above_1000_rpm_is_named() -> None:
    _, speed = claims(grid({("ode1", 3000.0): "too-deep"}))
    assert speed.borne_out is False
    assert "ode1 at 1/61440 s (too-deep at 3000 rpm)" in speed.answer
    assert claims(grid({("ode4", 3000.0): "too-deep"}))[1].borne_out is True
    faster = claims([*grid({}), cell(solver="ode4", rpm=6000.0, status="too-deep")])[1]
    assert (faster.borne_out, faster.answer[:17]) == (False, "Only at 6000 rpm:")
    assert claims(grid({("ode4", 3000.0): "too-deep", ("ode4", 710.0): "too-deep"}))[1].borne_out is False


def test_cells_that_do_not_cover_a_claim_say_so() -> None:
    order, speed = claims([cell(solver="imex2")])
    assert (order.borne_out, speed.borne_out) == (None, None)
    assert "do not cover" in order.answer
    assert "do not cover" in speed.answer


FloatArray = NDArray[np.float64]

OMEGA = 3e4  # rad/s, that of a loaded roller
# Limits are bisected from rays of 0.005 and octaves of steps: ten halvings leave less than this.
FOUND = 1e-3
# Largest real and imaginary z with |R(z)| <= 1 (Hairer & Wanner 1996, sect. IV.2; Kutta's classical method: 2.785 and
# 2 sqrt 2); Euler's and Heun's methods hold no undamped oscillation.
REAL_LIMITS = {"ode1": 2.0, "ode2": 2.0, "ode3": 2.512745, "ode4": 2.785293}
IMAGINARY_LIMITS = {"ode3": np.sqrt(3), "ode4": np.sqrt(8)}
# A half-explicit step is a perturbation of the true one: the steps of the kernels' own map agree to differences.
SAME_RADIUS = 1e-4
RAY = 2e-2  # the limit is looked up on rays, and Euler's region is flat along the imaginary axis
NEXT_TERM = 2  # the first term left out of the exponential is at most |z|^(order + 1), and some more follow
OTHER_DAMPING = 0.1  # of the fastest motion, what is not friction
STRUCTURAL_RATE = 1e5  # 1/s: without friction only the contacts' own damping remains, which is far slower


def oscillator(damping_per_s: float = 0.0) -> Linear:
    return Linear(
        motion=np.ones((1, 1)), stiffness=np.full((1, 1), -(OMEGA**2)), damping=np.full((1, 1), -damping_per_s)
    )


@pytest.mark.parametrize(("name", "limit"), REAL_LIMITS.items())
def test_decay(name: str, limit: float) -> None:
    found = explicit_limit(METHODS[name], np.array([-5e7 + 0j]))
    assert found == pytest.approx(limit / 5e7, rel=FOUND)


@pytest.mark.parametrize(("name", "limit"), IMAGINARY_LIMITS.items())
def test_oscillation(name: str, limit: float) -> None:
    weakly = OMEGA * complex(-1e-7, 1)
    found = explicit_limit(METHODS[name], np.array([weakly, weakly.conjugate()]))
    assert found == pytest.approx(limit / OMEGA, rel=FOUND)


@pytest.mark.parametrize("damping", [0.05, 0.5])
def test_euler_holds_a_damped_oscillation_to_twice_its_decay(damping: float) -> None:
    """|1 + h lambda|^2 <= 1 to h = -2 Re lambda / |lambda|^2."""
    decay = OMEGA * complex(-damping, np.sqrt(1 - damping**2))
    assert explicit_limit(METHODS["ode1"], np.array([decay])) == pytest.approx(2 * damping / OMEGA, rel=RAY)


@pytest.mark.parametrize("name", ["imex1", "imex2"])
def test_leapfrog_is_stable_to_two_over_the_frequency(name: str) -> None:
    assert longest_step(METHODS[name], oscillator()) == pytest.approx(2 / OMEGA, rel=FOUND)


@pytest.mark.parametrize("name", ["imex1", "imex2", "ros2"])
def test_implicit_damping_alone_sets_no_limit(name: str) -> None:
    system = Linear(motion=np.ones((1, 1)), stiffness=np.zeros((1, 1)), damping=np.full((1, 1), -5e7))
    assert longest_step(METHODS[name], system) is None


def test_free_and_growing_motions_set_no_limit() -> None:
    assert explicit_limit(METHODS["ode4"], np.array([0j, 1e-3 + 0j, 150 + 0j])) is None


@pytest.mark.parametrize("name", ["ode1", "ode2", "ode3", "ode4"])
def test_stability_function_is_the_exponential_to_the_method_s_order(name: str) -> None:
    method, z = METHODS[name], 0.01 * np.exp(1j * np.array([0.3, 2.0, np.pi]))
    assert np.abs(stability_function(method, z) - np.exp(z)).max() < NEXT_TERM * 0.01 ** (method.order + 1)


@pytest.fixture(scope="module")
def rest() -> tuple[Parameters, FloatArray]:
    group = StabilityGroup(scene="interference-outer", rpm=710.0, critical_velocity_m_s=0.5)
    return balanced(FULL.scene(StabilityCase(group=group, solver="imex2", steps_per_s=61440)), pitches=0.25)


def kernel_map(method: Method, model: Parameters, state: FloatArray, step_s: float, remembers: bool) -> FloatArray:
    """Derivative of one step of the compiled method at `state`, by central differences; roller angles left out."""
    half, size = len(state) // 2, len(state)
    rollers = half // 2 - 3
    whole = 2 * size if remembers else size
    keep = np.r_[0:rollers, 2 * rollers : half, half:size]
    if remembers:
        keep = np.r_[keep, size + half : 2 * size]

    def step(start: FloatArray) -> FloatArray:
        y, memory = start[:size].copy(), start[size:].copy() if remembers else np.zeros(size)
        take_steps(model, y, method, step_s=step_s, intervals=1, memory=memory)
        return np.concatenate([y, memory])[:whole]

    columns = []
    base = np.concatenate([state, np.zeros(whole - size)])
    for i in keep:
        nudge = np.zeros(whole)
        nudge[i] = 1e-10 if i < half else 1e-6
        columns.append((step(base + nudge) - step(base - nudge))[keep] / (2 * nudge[i]))
    return np.column_stack(columns)


@pytest.mark.parametrize(("name", "remembers"), [("imex1", False), ("imex2", True), ("ros2", False)])
@pytest.mark.parametrize("steps_per_s", [61440, 15360])
def test_the_kernels_step_grows_as_the_linear_map(
    name: str, remembers: bool, steps_per_s: int, rest: tuple[Parameters, FloatArray]
) -> None:
    from threadpoolctl import threadpool_limits

    model, state = rest
    with threadpool_limits(1):
        method, h = METHODS[name], 1 / steps_per_s
        linear = step_map(method, linearise(model, state), h)
        own = kernel_map(method, model, state, h, remembers)
        assert spectral_radius(own) == pytest.approx(spectral_radius(linear), rel=SAME_RADIUS)


def test_friction_at_rest_has_the_slope_of_the_steepest_contact(rest: tuple[Parameters, FloatArray]) -> None:
    """A hundredth of the critical velocity makes friction relax a hundred times faster; without it nothing does."""
    from threadpoolctl import threadpool_limits

    model, state = rest
    fast = model._replace(law=model.law._replace(critical_velocity=0.005))
    with threadpool_limits(1):
        slow_rate, fast_rate, none = (
            -np.linalg.eigvals(linearise(m, state).matrix).real.min() for m in (model, fast, without_friction(model))
        )
    assert fast_rate == pytest.approx(100 * slow_rate, rel=OTHER_DAMPING)
    assert none < STRUCTURAL_RATE


STORED = Path(__file__).parents[2] / "reports" / "stability.json"


@pytest.fixture(scope="module")
def stored() -> dict[str, Any]:
    content: dict[str, Any] = json.loads(STORED.read_text(encoding="utf-8"))
    return content


def test_it_is_the_whole_map_and_says_where_it_comes_from(stored: dict[str, Any]) -> None:
    assert stored["grid"] == to_json(FULL)
    assert len(stored["cells"]) == len(list(FULL.cases))
    assert stored["machine"]["processor"]
    assert stored["git_revision"]
    assert stored["made_utc"].startswith("20")


def test_no_ok_cell_is_unlike_its_converged_run(stored: dict[str, Any]) -> None:
    good = [c for c in stored["cells"] if c["status"] == "ok"]
    assert good
    assert max(c["cage_error"] for c in good) <= CAGE_LIMIT
    assert min(c["load_part"] for c in good) >= LOAD_RANGE[0]
    typical = {name: statistics.median(abs(c["errors"][name]) for c in good) for name in good[0]["errors"]}
    assert len(typical) == 4, "cage, two bands, drive power"
    assert all(error < TOLERANCE[KINDS.get(name, "band_rms")] for name, error in typical.items())


def test_planted_failures_are_caught_and_converged_runs_are_not_flagged(stored: dict[str, Any]) -> None:
    assert len(stored["planted"]) == 3 * 2 * 2 * len(FULL.scenes)
    assert [p for p in stored["planted"] if not p["caught"]] == []
    assert [r for r in stored["references"] if r["status"] not in ("ok", "skidding")] == []


def test_the_default_turns_its_cage_and_carries_its_load_to_3000_rpm(stored: dict[str, Any]) -> None:
    """Not that every such cell is ok: that also asks for right levels; the report names those that are not.

    At 6000 rpm the cage of the scene without play slows down all the time, and the default step is not fine enough.
    """
    solver = paper_scene().solver
    own = [c for c in stored["cells"] if c["solver"] == solver.name and c["dt_s"] == pytest.approx(solver.step_s)]
    assert len(own) == len(list(FULL.groups))
    own = [c for c in own if c["rpm"] <= 3000]
    assert [(c["scene"], c["rpm"], c["reason"]) for c in own if c["run_status"] != "ok"] == []
    assert max(c["cage_error"] for c in own) <= CAGE_LIMIT
    assert min(c["load_part"] for c in own) >= LOAD_RANGE[0]


def test_the_map_of_the_rigs_scene_is_whole_and_good_to_the_predicted_limit() -> None:
    content = json.loads((STORED.parent / "rig_stability.json").read_text(encoding="utf-8"))
    assert content["grid"] == to_json(RIG)
    cells = content["cells"]
    assert len(cells) == len(list(RIG.cases))
    assert [r for r in content["references"] if r["status"] != "ok"] == []
    of_default = [c for c in cells if c["solver"] == load_scene("rig").solver.name]
    for cell in of_default:
        below = cell["dt_s"] < cell["predicted_elastic_limit_dt_s"]
        assert cell["stable"] == below
        assert (cell["status"] == "ok") == below or (below and cell["rpm"] >= 3000), "then its own step is too long"
