"""Cases, checked key by key; simulated against measured files: planted errors, how often a right one fails."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from srbval import Analysis, Origin, SrbvalError, Validation, analyse, paper_scene, simulate, write_run
from srbval.bearing import Fault, load_bearing
from srbval.comparison.compared_quantities import CAGE_RATIO, HARMONIC, SIDEBAND_LEVEL, biases, read_quantities
from srbval.comparison.counterpart import AnalysedRun
from srbval.errors import ConfigurationError, DataError, NumericsError
from srbval.recordings.registry import add
from srbval.report.findings.findings import select_comparisons
from srbval.validation import sides
from srbval.validation.case import Source, ValidationCase, case_of_pairs, files_of_source, load_case, write_case
from srbval.validation.sides import pair_files, state_in_name
from srbval.validation.validate import validate
from tests.recordings import files
from tests.recordings.synthetic_record import vibration

CASE = """
title = "A model of mine"
bearing = "skf-6205"
[simulated]
band_hz = [500, 1500]
unit = "m/s2"
[measured]
band_hz = [2000, 4000]
channel = "DE"
[tolerance]
cage_pct = 0.1
[uncertainty]
cage_pct = 0.05
[[pair]]
state = "outer"
measured = "OR.csv"
simulated = ["run1.csv", "run2.csv"]
[[pair]]
state = "inner"
measured = { file = "IR.csv", channel = "FE" }
simulated = { scene = "rig" }
used_for = "blind"
[[published]]
state = "outer"
rpm = 710
kinematic_hz = 96.79
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(CASE)
    return path


def test_settings_of_a_pair_go_over_those_of_its_side(file):
    case = load_case(file)
    outer, inner = case.pair
    assert (case.known_bearing.name, case.tolerance.cage_pct) == ("skf-6205", 0.1)
    assert case.published[0].kinematic_hz == 96.79
    assert case.side(outer, "measured") == Source(band_hz=(2000, 4000), channel="DE", file=("OR.csv",))
    measured = case.side(inner, "measured")
    assert measured is not None
    assert (measured.channel, measured.settings.band_hz, inner.used_for) == ("FE", (2000, 4000), "blind")
    assert case.side(inner, "simulated") == Source(band_hz=(500, 1500), unit="m/s2", scene="rig")


def test_a_written_case_is_the_same_and_values_can_be_changed_by_their_keys(file):
    case = load_case(file)
    write_case(case, file.with_name("again.toml"))
    again = load_case(file.with_name("again.toml"))
    assert dataclasses.replace(again, path=None) == dataclasses.replace(case, path=None)
    changed = load_case(file, {"measured.channel": "BA", "tolerance": {"level_db": 3.0, "cage_pct": "2 %"}})
    assert (changed.measured.channel, changed.tolerance.level_db, changed.tolerance.cage_pct) == ("BA", 3.0, 2.0)


def test_a_bearing_may_stand_in_the_case():
    orders = {"orders": {"rolling_elements": 9, "bpfo": 3.585, "bpfi": 5.415, "bsf": 2.357, "ftf": 0.398}}
    case = case_of_pairs([{"measured": "a.csv"}], orders)
    assert (case.known_bearing.rolling_elements, case.known_bearing.orders.bpfo) == (9, 3.585)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("cage_pct = 0.1", "cage_pct = -0.1", "tolerance cage_pct = -0.1 must be above 0"),
        ("band_hz = [500, 1500]", "band_hz = [1500, 500]", "the second edge must be above the first"),
        ('channel = "DE"', 'chanel = "DE"', "measured: unknown key 'chanel'; did you mean 'channel'"),
        ('used_for = "blind"', 'used_for = "fun"', "must be one of fit, withheld, blind"),
        ('bearing = "skf-6205"', 'bearing = "skf-6250"', "bearing 'skf-6250' is not known"),
        ('bearing = "skf-6205"', 'bearing = "skf-6205"\norders = { bpfo = 1 }', "not several"),
    ],
)
def test_what_is_wrong_is_said(file, old, new, said):
    file.write_text(CASE.replace(old, new))
    with pytest.raises(ConfigurationError, match=said):
        load_case(file)


def test_a_case_without_pairs_and_an_unknown_name_are_refused(tmp_path):
    with pytest.raises(ConfigurationError, match=r"no \[\[pair\]\]"):
        case_of_pairs([])
    for name, said in (("torino", "torino-22240"), (tmp_path / "none.toml", "no such file")):
        with pytest.raises(SrbvalError, match=said):
            load_case(name)


def test_files_are_named_by_path_pattern_or_registered_name(tmp_path):
    for name in ("b2.csv", "b1.csv"):
        (tmp_path / name).touch()
    found = files_of_source(Source(file=("b*.csv", "OR_877rpm_sample")), tmp_path, "measured")
    assert [path.name for path in found][:2] == ["b1.csv", "b2.csv"]
    assert found[2].name.startswith("OR_877rpm_sample")
    for name, said in (("c*.csv", "no file fits the pattern"), ("c.csv", "no file"), ("OR_", "registered recordings")):
        with pytest.raises(DataError, match=said):
            files_of_source(Source(file=(name,)), tmp_path, "measured")


FS_HZ, SECONDS, RPM = 20_480.0, 4.0, 860.0
BEARING = load_bearing("skf-22240")
SEEDS = 200  # of a right simulation with noise: at most 5 % may be called different
SPREAD_PCT = 0.05  # standard deviation of a simulation that has an error and states it
OF_SIMULATED = {"rpm": RPM, "unit": "m/s2", "fs_hz": FS_HZ, "band_hz": [1400, 2800]}
SIMULATED = {f"simulated.{key}": value for key, value in OF_SIMULATED.items()}


def signal(state: Fault, seed: int, shift_pct: float, seconds: float, rpm: float = RPM) -> np.ndarray:
    """Vibration of the impulse model with its race lines shifted."""
    shifted = {name: getattr(BEARING.orders, name) * (1 + shift_pct / 100) for name in ("bpfo", "bpfi")}
    turns = np.arange(int(FS_HZ * seconds)) * rpm / 60 / FS_HZ
    return vibration(state, dataclasses.replace(BEARING.orders, **shifted), turns, np.random.default_rng(seed))


def simulated(path: Path, state: Fault, *, seed: int, shift_pct: float = 0.0, seconds: float = SECONDS) -> str:
    """A simulated signal as a bare array."""
    np.save(path, signal(state, seed, shift_pct, seconds))
    return str(path)


def measured(
    path: Path, state: Fault, *, seed: int, seconds: float = SECONDS, rpm: float = RPM, nominal: float = 877.0
) -> str:
    """A record in the layout of the rig's excerpts, with its tachometer."""
    values = signal(state, seed, 0.0, seconds, rpm)
    times = np.arange(values.size) / FS_HZ
    changes = {"acc_m_s2": values, "time_acc": times, "condition": state.code, "rpm_nominal": nominal}
    files.excerpt(path, **changes, rpm=np.full(values.size, rpm))
    return str(path)


def case_of(folder: Path, shift_pct: float, seed: int = 1, **changes: Any) -> ValidationCase:
    pair = {
        "state": "outer",
        "simulated": simulated(folder / "sim_outer.npy", Fault.OUTER, seed=2 * seed, shift_pct=shift_pct),
        "measured": measured(folder / "OR_877rpm_made.mat", Fault.OUTER, seed=2 * seed + 1),
    }
    return case_of_pairs([pair], {key: value for key, value in (SIMULATED | changes).items() if value is not None})


@pytest.mark.parametrize(
    ("shift_pct", "stated", "quantity", "verdict"),
    [
        (0.3, {"uncertainty": 0.05}, "BPFO", "differs"),
        (0.02, {"uncertainty": 0.05}, "BPFO", "not resolved"),
        (0.0, {"uncertainty": 0.05}, "BPFO", "agrees"),
        (0.3, {"uncertainty": 0.02, "tolerance": 0.05}, "cage ratio", "missed"),
        (0.3, {}, "BPFO", "insufficient data"),
    ],
)
def test_a_planted_shift_is_found_and_a_small_one_is_not(shift_pct, stated, quantity, verdict, tmp_path):
    found = validate(case_of(tmp_path, shift_pct, **{f"{key}.cage_pct": value for key, value in stated.items()}))
    table = found.table.set_index("quantity")
    assert table.loc["BPFO", "error"] == pytest.approx(shift_pct, abs=0.02)
    assert table.loc[quantity, "verdict"] == verdict
    assert found.holds is (verdict != "missed")
    assert found.headline.startswith("No verdict") is (verdict == "insufficient data")


def test_nothing_simulated_passes_as_measured(tmp_path):
    write_run(simulate(paper_scene(model="impulse", duration="2 s", defect={"kind": "outer"})), tmp_path / "run.h5")
    pairs = [{"simulated": str(tmp_path / "run.h5"), "measured": str(tmp_path / "run.h5")}]
    with pytest.raises(ConfigurationError, match="states that it is simulated"):
        validate(case_of_pairs(pairs))


@pytest.mark.parametrize(
    ("changes", "error", "said"),
    [
        ({"simulated.fs_hz": 1000.0}, SrbvalError, "band"),
        ({"simulated.fs_hz": None}, DataError, "--set simulated.channel=NAME"),
        ({"simulated.state": "inner"}, ConfigurationError, "inner, but its pair has the state outer"),
        ({"bearing": "orders 0,0,0,0"}, ConfigurationError, "orders"),
        ({"simulated.scene": "rig"}, ConfigurationError, "needs either files or a scene"),
    ],
)
def test_bad_input_is_refused_with_its_reason(changes, error, said, tmp_path):
    with pytest.raises(error, match=said):
        validate(case_of(tmp_path, 0.0, **changes))


def test_a_pair_that_fails_leaves_the_others(tmp_path):
    good = case_of(tmp_path, 0.0)
    broken = dataclasses.replace(good.pair[0], measured=Source(file=("none.npy",)))
    found = validate(dataclasses.replace(good, pair=(broken, *good.pair)))
    assert [one["pair"] for one in found.failed] == [1]
    assert list(found.pairs["pair"]) == [2]


def test_both_races_make_a_sum(tmp_path):
    faults = (Fault.OUTER, Fault.INNER)
    pairs = [{"measured": measured(tmp_path / f"{one.code}_877rpm_made.mat", one, seed=3)} for one in faults]
    (total,) = validate(case_of_pairs(pairs)).sums
    assert total["total"] == pytest.approx(19, abs=2e-2)  # two records slip at random
    assert (total["origin"], total["closed"]) == ("measured", True)


def test_files_are_paired_by_state_and_nearest_speed(tmp_path):
    states = {"outer_a": Fault.OUTER, "outer_b": Fault.OUTER, "inner": Fault.INNER}
    own = [simulated(tmp_path / f"sim_{name}.npy", one, seed=1, seconds=0.5) for name, one in states.items()]
    faults = (Fault.OUTER, Fault.INNER)
    theirs = [measured(tmp_path / f"{one.code}_877rpm_made.mat", one, seed=3, seconds=0.5) for one in faults]
    settings = {"simulated": Source(fs_hz=FS_HZ, rpm=RPM, unit="m/s2"), "measured": Source()}
    outer, inner = pair_files(own, theirs, settings)
    assert (outer["state"], outer["simulated"], outer["measured"]) == ("outer", own[:2], theirs[:1])
    assert "state by its name (simulated) and the file (measured)" in inner["how"]
    with pytest.raises(ConfigurationError, match="no measured file has the state inner race"):
        pair_files(own, theirs[:1], settings)


def test_a_file_whose_state_is_not_known_is_refused(tmp_path):
    assert state_in_name("outer_and_inner") is None
    file = simulated(tmp_path / "x.npy", Fault.OUTER, seed=1, seconds=0.5)
    settings = {side: Source(fs_hz=FS_HZ, rpm=RPM, unit="m/s2") for side in ("simulated", "measured")}
    with pytest.raises(ConfigurationError, match="--state"):
        pair_files([file], [file], settings)
    assert pair_files([file], [file], settings, Fault.OUTER)[0]["state"] == "outer"


OUTSIDE = """
import numpy as np
def simulate(scene):
    time_s = np.arange(int(scene.output_rate_hz * scene.duration_s)) / scene.output_rate_hz
    since_s = np.mod(time_s, 1 / (19 * 0.4312 * scene.shaft_hz))
    return time_s, np.exp(-400 * since_s) * np.sin(2 * np.pi * 900 * since_s)
"""


def test_a_model_from_outside_is_run_beside_the_record(tmp_path):
    (tmp_path / "mine.py").write_text(OUTSIDE)
    record = measured(tmp_path / "OR_877rpm_made.mat", Fault.OUTER, seed=3)
    side = {"scene": "paper", "model": f"{tmp_path}/mine.py:simulate"}
    found = validate(case_of_pairs([{"simulated": side, "measured": record}])).table.set_index("quantity")
    assert found.loc["cage ratio", "simulated"] == pytest.approx(0.4312, rel=1e-4)
    assert found.loc["cage ratio", "verdict"] == "insufficient data"  # the paper's scene says nothing about it


def test_another_bearing_on_another_rig(recordings_dir):
    """The planar model has no contact angle, and the rig's outer-race line is 0.3 % above kinematics without one."""
    for name in ("105_IR007_0_12kDE.mat", "130_OR007at6_0_12kDE.mat"):
        add(recordings_dir / "cwru" / name)
    table = validate("cwru-6205").table.set_index("quantity")
    assert table.loc["BPFO", "simulated_deviation_pct"] == pytest.approx(0.0, abs=0.05)
    assert table.loc["BPFO", "measured_deviation_pct"] == pytest.approx(0.32, abs=0.05)
    assert set(table["verdict"]) == {"insufficient data"}


STATES, CAGE, LINES = (Fault.HEALTHY, Fault.OUTER, Fault.INNER), 0.432, {"outer": "BPFO", "inner": "BPFI"}
KNOWN = {
    (defect, name): {"shift": 0.0, "inputs_ci95": size, "grid_ci95": 0.0}
    for defect, line in LINES.items()
    for name, size in (("cage ratio", 0.0004), (line, 0.0076), (f"2x{line}", 1.0), (f"{line} sidebands", 1.0))
}


def rig_files(folder: Path, **speed: float) -> Path:
    """Three records of the rig, made by the impulse model."""
    for seed, state in enumerate(STATES, start=1):
        name = f"{state.code}_{speed.get('nominal', 877):g}rpm_made.mat"
        measured(folder / name, state, seed=seed, seconds=2.0, **speed)
    return folder


def another_impulse_model(rig: Analysis, *_: Any, **__: Any) -> AnalysedRun:
    """A stand-in for the model's run: the impulse model once more, other noise, the cage a little too fast."""
    state = rig.recording.state or Fault.HEALTHY
    turns = np.arange(int(FS_HZ * 2)) * rig.speed.value_hz / FS_HZ
    orders = dataclasses.replace(BEARING.orders, bpfo=19 * CAGE, bpfi=19 * (1 - CAGE))
    channels = {"x": vibration(state, orders, turns, np.random.default_rng(99))}
    made = dataclasses.replace(rig.recording, origin=Origin.SIMULATED, channels=channels, channel="x")
    order = {Fault.OUTER: 19 * CAGE, Fault.INNER: 19 * (1 - CAGE)}.get(state)
    analysis = analyse(made, bearing=BEARING, speed=rig.speed)
    values = read_quantities(analysis, state, order)
    run = SimpleNamespace(cage_ratio=CAGE)
    return AnalysedRun(run=run, analysis=analysis, values=values)


def shipped_case(folder: Path, counterpart: Any = another_impulse_model) -> Validation:
    add(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("srbval.validation.validate.effects_of", lambda _: KNOWN)
        patch.setattr(sides, "run_counterpart", counterpart)
        return validate("torino-22240", jobs=2)


def test_every_registered_record_of_the_rig_is_compared_at_its_own_speed(tmp_path):
    """Nothing but files that are registered: each adds its record, and its rows to every kind of quantity."""
    (tmp_path / "more").mkdir()
    found = shipped_case(rig_files(tmp_path))
    assert [pair["state"] for pair in found.pairs.to_dict("records")] == ["healthy", "inner", "outer"]
    assert found.pairs["measured_facts"].iloc[1]["shaft_from"] == "tachometer"
    frame = select_comparisons(found.comparisons).set_index(["state", "kind"])
    for state in ("outer", "inner"):
        cage = frame.loc[state, CAGE_RATIO.kind]
        assert cage["error"] == pytest.approx(100 * (CAGE / cage["rig"] - 1))  # not of the line: its sign is another
        assert cage["model"] == pytest.approx(CAGE)
        assert cage["verdict"] == "differs", "0.3 % are far beyond what is not known"
        assert cage["uncertainty"] > 0.09  # the known term's
    levels = frame.xs(SIDEBAND_LEVEL.kind, level="kind")
    assert levels[["model_present", "rig_present"]].to_numpy().tolist() == [[True, True]]
    after = shipped_case(rig_files(tmp_path / "more", nominal=727.0, rpm=709.0))
    frames = (select_comparisons(one.comparisons) for one in (found, after))
    counted = [{b["kind"]: b["records"] for b in biases(one.assign(used_for="withheld"))} for one in frames]
    for row in (CAGE_RATIO, HARMONIC[2]):  # higher harmonics need not show on both sides
        assert (counted[0][row.kind], counted[1][row.kind]) == (2, 4)
    assert not select_comparisons(after.comparisons)["record"].str.contains("H_727").any()


def test_effects_of_the_paper_s_inputs_hold_for_the_rig_s_bearing_alone(file, monkeypatch):
    monkeypatch.setattr(sides, "run_counterpart", lambda *_, **__: SimpleNamespace(analysis=None, values={}))
    for bearing, scene in (("skf-6205", None), ("skf-22240", "paper")):
        case, against = dataclasses.replace(load_case(file), bearing=bearing), SimpleNamespace(analyses=(None,))
        assert sides.run_scene(Source(scene="paper"), case, against, Fault.OUTER).scene == scene


def test_a_healthy_record_costs_no_run_and_a_failed_run_leaves_the_record(tmp_path):
    asked = []

    def counterpart(rig: Analysis, *_: Any, **__: Any) -> AnalysedRun:
        asked.append(rig.recording.state)
        raise NumericsError("the load was lost")

    failed = shipped_case(rig_files(tmp_path), counterpart)
    assert sorted(asked) == [Fault.INNER, Fault.OUTER]
    assert list(failed.pairs["problem"]) == ["", "the load was lost", "the load was lost"]
    assert select_comparisons(failed.comparisons).empty
    assert set(failed.table["verdict"]) == {"insufficient data"}


def verdict_of(case: ValidationCase) -> pd.Series:
    found: pd.Series = validate(case).table.set_index("quantity").loc["BPFO", ["error", "uncertainty", "verdict"]]
    return found


@pytest.mark.long_form
def test_right_simulations_are_seldom_called_different_and_intervals_hold_the_truth(tmp_path):
    """Both sides are read in noise; the second simulation of each seed is off by a normal error that it states."""
    rng, right, off = np.random.default_rng(11), [], []
    for seed in range(SEEDS):
        right.append(verdict_of(case_of(tmp_path, 0.0, seed, **{"uncertainty.cage_pct": 1e-6})))
        shift_pct = float(rng.normal(0.0, SPREAD_PCT))
        off.append(verdict_of(case_of(tmp_path, shift_pct, seed, **{"uncertainty.cage_pct": 1.96 * SPREAD_PCT})))
    covered = [float((rows["error"].abs() <= rows["uncertainty"]).mean()) for rows in map(pd.DataFrame, (right, off))]
    assert (pd.DataFrame(right)["verdict"] == "differs").mean() <= 0.05
    assert 0.93 <= covered[1] <= 0.98
