"""Simulated signals: uneven times, accelerations, speeds of cage and shaft, and errors; signals of tachometers."""

import csv
import shlex
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from srbval.errors import DataError
from srbval.recordings import Origin, Recording, RecordingSettings, SpeedSignal, SpeedSource, load_recording
from srbval.recordings import speed as speed_module
from srbval.recordings.loaders.nested import add_objects
from srbval.recordings.registry import add, recording_of
from srbval.recordings.simulated import differentiate, resample
from srbval.recordings.speed import SCALE_CI95, pulse_times, speed_from_pulses, tachometer_speed

from . import files

BAND_HZ = (500.0, 1500.0)
FS_HZ, STEP_S = 8000.0, 5e-5
EVEN = np.arange(10_000) * STEP_S
ENDS = 200  # samples at either end that the low-pass or the mirror image may spoil
SPLINE = 4e-4  # of a tone of 1 kHz at 20 uneven samples in a period: (2 pi / 20)^4 / 384 is 2.5e-5 for even ones
STOPPED = 1e-4  # of a tone: 80 dB
EXACT = 1e-6  # of an acceleration: rounding alone, away from the ends
AT_ENDS = 0.02  # of it, five samples from the ends, where the mirror image bends
RATIO = 1e-5  # of a cage ratio, read without noise


def uneven_times(step_s=STEP_S, seconds=0.5):
    """Times with steps of 0.6 to 1.4 times the mean step."""
    steps = np.random.default_rng(0).uniform(0.6, 1.4, round(seconds / step_s)) * step_s
    return np.concatenate(([0.0], np.cumsum(steps)))


def tones(times_s, hz=(700.0, 1000.0)):
    return np.sum([np.sin(2 * np.pi * f * times_s + i) for i, f in enumerate(hz)], axis=0)


def table(path, columns, comment="# made up"):
    rows = [",".join(f"{x:.17g}" for x in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join([comment, ",".join(columns), *rows, ""]))
    return path


def load(path, **settings):
    return load_recording(path, RecordingSettings(**settings))


def signal(recording):
    return recording.channels[recording.channel or ""]


def test_uneven_times_become_even(tmp_path):
    times = uneven_times()
    path = table(tmp_path / "a.csv", {"time": times, "acc [m/s2]": tones(times)})
    with pytest.raises(DataError, match=r"no even times \(the times of time are uneven.*\): --resample HZ"):
        load(path)
    with pytest.raises(DataError, match=r"uneven.*--fs assumes even times. Give --resample without --fs"):
        load(path, fs_hz=20_000.0, resample_hz=FS_HZ)
    found = load(path, resample_hz=FS_HZ, band_hz=BAND_HZ)
    assert (found.fs_hz, found.cautions) == (FS_HZ, ())
    true = tones(np.arange(found.samples) / FS_HZ)
    off = (signal(found) - true)[ENDS:-ENDS]
    assert np.abs(off).max() < SPLINE
    assert 1 / 3 < found.resampling_error / (np.std(off) / np.std(true)) < 3  # the estimate, without the truth


def test_what_the_new_rate_does_not_hold_is_removed():
    """A tone above half of the new rate would otherwise appear at the difference frequency."""
    times = uneven_times(1e-5)
    assert np.abs(resample(times, tones(times, (4500.0,)), FS_HZ)[ENDS:-ENDS]).max() < STOPPED


def test_events_are_written_twice(tmp_path):
    """A solver writes both sides of an event; rounding of two values a nanosecond apart must not give a slope."""
    times = np.sort(np.concatenate([uneven_times(), [0.1, 0.1, 0.2, 0.2 + 1e-9]]))
    rounding = 1e-4 * (np.arange(times.size) % 2)
    path = table(tmp_path / "a.csv", {"t": times, "a [m/s2]": tones(times) + rounding})
    found = load(path, resample_hz=FS_HZ, band_hz=BAND_HZ)
    assert np.abs(signal(found) - tones(np.arange(found.samples) / FS_HZ))[ENDS:-ENDS].max() < SPLINE + rounding.max()


GAP, RISING = uneven_times(), "export them again, rising, with all their digits and their unit"
GAP[200:] += 1e-3  # after about 10 ms


@pytest.mark.parametrize(
    ("times", "settings", "said"),
    [
        (GAP, {"band_hz": BAND_HZ}, r"a time step of 0\.001\d+ s at 0\.0\d+ s is too long .* 1500 Hz; the .*--skip"),
        (GAP, {}, r"a time step of 0\.00\d+ s at .* too long .* 3200 Hz"),
        (GAP, {"band_hz": BAND_HZ, "skip_s": 0.1}, ""),
        (GAP, {"band_hz": (50.0, 200.0)}, "caution: nothing but error in this band"),
        (uneven_times(1.1e-4), {}, "caution: steps of up to 0.000154 s: .* reliable below 1623 Hz only"),
        (uneven_times(), {"band_hz": (500.0, 3500.0)}, r"--resample 8000 Hz must be between 8750 and 160\d+ Hz"),
        (uneven_times(), {"resample_hz": 1e9}, r"--resample 1e\+09 Hz must be between 512\.\d+ and 160\d+ Hz"),
        (uneven_times(), {"skip_s": 9.0}, r"lasts 0\.4\d+ s; without the first 9 s \(--skip\) 0 samples remain"),
        (uneven_times()[::-1].copy(), {}, RISING),
        (np.where(np.arange(GAP.size) == 9, 1.0, GAP), {}, RISING),
        (uneven_times() * 1e3, {}, RISING),  # a mean rate of 20 Hz if these were seconds
        (EVEN.round(6) + 0.5, {"band_hz": BAND_HZ}, ""),  # rounded digits are not uneven
    ],
)
def test_steps_that_do_not_carry_the_band(tmp_path, times, settings, said):
    path, given = table(tmp_path / "a.csv", {"time": times, "a [m/s2]": tones(times)}), {"resample_hz": FS_HZ}
    if said and not said.startswith("caution"):
        with pytest.raises(DataError, match=said) as refused:
            load(path, **given | settings)
        assert "--fs" not in str(refused.value)
        return
    found = load(path, **given | settings)
    assert found.fs_hz == FS_HZ
    assert len(found.cautions) == bool(said)


@pytest.mark.parametrize(
    ("unit", "per_m", "stated"),
    [
        ("m", 1.0, {"origin": Origin.SIMULATED}),
        ("mm", 1e3, {"derivative": 2}),
        ("um", 1e6, {"origin": Origin.SIMULATED}),
        ("m/s", 1.0, {"origin": Origin.SIMULATED}),
        ("mm/s", 1e3, {"derivative": 1}),
        ("", 1.0, {"derivative": 2}),
        ("", 1.0, {"derivative": 1}),
        ("", 1e3, {"derivative": 2, "unit": "mm"}),
    ],
)
def test_accelerations(tmp_path, unit, per_m, stated):
    """A tone of 123.4 Hz without a whole number of periods, on a drift: sign, (2 pi f)^n, and no step at the ends."""
    rate, drift = 2 * np.pi * 123.4, 3.0
    acceleration, samples = np.cos(rate * EVEN), drift * EVEN - np.cos(rate * EVEN) / rate**2
    if unit.endswith("/s") or stated.get("derivative") == 1:
        acceleration, samples = acceleration + drift, drift * EVEN + np.sin(rate * EVEN) / rate
    name = f"x [{unit}]" if unit else "x"
    found = load(table(tmp_path / "a.csv", {"time [s]": EVEN, name: per_m * samples}), **stated)
    assert found.unit == "m/s2"
    off = np.abs(signal(found) - acceleration)
    assert off[ENDS:-ENDS].max() < EXACT
    assert off[5:-5].max() < AT_ENDS


def test_noise_above_every_band_is_not_amplified():
    power = np.abs(np.fft.rfft(differentiate(np.random.default_rng(0).normal(size=20_000), 1.0, 2))) ** 2
    assert power[-100:].mean() < 1e-3 * power[7900:8000].mean()


CAGE_IN_M = "b must be an angle or a speed; its unit is m instead of one of rad, deg, rev, rpm, Hz, rad/s"


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"channel": "x [m/s2]", "derivative": 1}, "in m/s2; use 1 for mm/s or 2 for um"),
        ({"channel": "x [mm]", "derivative": 1}, "fit samples in um;"),
        ({"channel": "x [m/s]"}, "in mm/s;"),
        ({"channel": "x [mm]", "cage_channel": "b"}, CAGE_IN_M),
        ({"channel": "a", "cage_channel": "a"}, "no vibration to analyse, only a"),
        ({"cage_channel": "kage"}, "no channel 'kage'; it has a"),
    ],
)
def test_settings_that_contradict_a_unit(tmp_path, settings, said):
    names = ("time [s]", "a [rad]", "b", "x [m/s2]", "x [mm]", "x [m/s]")
    with pytest.raises(DataError, match=said):
        load(table(tmp_path / "a.csv", dict.fromkeys(names, EVEN)), **{"derivative": 2} | settings)


SHAFT_HZ, CAGE = 12.0, 0.4315


@pytest.mark.parametrize(
    ("name", "of_turns", "resample_hz"),
    [
        ("cage [rad]", lambda turns: 2 * np.pi * turns, FS_HZ),
        ("cage [deg]", lambda turns: 360 * turns % 360, None),  # wrapped
        ("cage_rad", lambda turns: -2 * np.pi * turns, None),  # the other way round
        ("cage [rpm]", lambda turns: np.full(turns.size, 60 * CAGE * SHAFT_HZ), FS_HZ),
        ("cage_rad_s", lambda turns: np.full(turns.size, 2 * np.pi * CAGE * SHAFT_HZ), None),
    ],
)
def test_cage_and_shaft(tmp_path, name, of_turns, resample_hz):
    """The start, during which the cage slips, is cut."""
    times = uneven_times() if resample_hz else EVEN
    turns = CAGE * SHAFT_HZ * times + 0.3 * np.clip(0.1 - times, 0, None)
    columns = {"time [s]": times, "a [m/s2]": tones(times), name: of_turns(turns)}
    path = table(tmp_path / "a.csv", columns | {"shaft [rad]": 2 * np.pi * SHAFT_HZ * times})
    given = {"resample_hz": resample_hz, "skip_s": 0.1, "cage_channel": name, "origin": Origin.SIMULATED}
    for more in ({"shaft_channel": "shaft"}, {"rpm": 60 * SHAFT_HZ}):
        found = load(path, channel="a", **given, **more)
        assert found.cage_ratio == pytest.approx(CAGE, rel=RATIO)
        assert (found.speed.source, found.speed.ci95_hz) == (SpeedSource.PRESCRIBED, 0.0)
        assert found.speed.value_hz == pytest.approx(SHAFT_HZ, rel=RATIO)
    assert found.seconds == pytest.approx(times[-1] - 0.1, abs=2 / FS_HZ)
    assert "cage" not in " ".join(found.channels)
    assert load(path, channel="a", **given).cage_ratio is None


def test_nothing_simulated_is_declared_measured(tmp_path):
    for name, said in (("sim", "Simulated by a multibody code"), ("rig", "test bench")):
        table(tmp_path / name, {"time [s]": EVEN, "a [m/s2]": tones(EVEN)}, f"# origin = {said}")
    assert [load(tmp_path / name).origin for name in ("sim", "rig")] == [Origin.SIMULATED, Origin.MEASURED]
    with pytest.raises(DataError, match="states that it is simulated; it cannot be declared measured"):
        load(tmp_path / "sim", origin=Origin.MEASURED)
    add(tmp_path / "rig", settings=RecordingSettings(origin=Origin.SIMULATED, rpm=1500.0, skip_s=0.1))
    found = recording_of(tmp_path / "rig")
    assert (found.origin, found.speed.ci95_hz, found.samples) == (Origin.SIMULATED, 0.0, 8000)


def test_options_and_a_table_of_labels_state_the_same(tmp_path, srbval_json):
    times = uneven_times(seconds=2.0)
    columns = {"time [s]": times, "x [mm]": tones(times), "cage [rad]": 2 * np.pi * CAGE * 25 * times}
    file, labels = table(tmp_path / "a.csv", columns), tmp_path / "labels.csv"
    given = "--resample 8000 --derivative 2 --skip 0.25 --cage-channel cage --origin simulated --band 500 1500"
    document = srbval_json("analyse", file, *shlex.split(given), "--bearing", "skf-6205", "--rpm", "1500")
    assert (document["origin"], document["fs_hz"]) == ("simulated", FS_HZ)
    assert document["cage_ratio"] == pytest.approx(CAGE, rel=RATIO)
    assert 0 < document["resampling_error"] < SPLINE
    header = "file;resample;derivative;skip;cage_channel;origin;band;bearing;rpm"
    labels.write_text(f"{header}\na.csv;8000;2;0,25;cage;simulated;500 1500;skf-6205;1500")
    (entry,) = srbval_json("data", "add", tmp_path, "--table", labels)["recordings"]
    assert (entry["origin"], entry["fs_hz"], entry["reason"]) == ("simulated", FS_HZ, None)
    assert recording_of(file).cage_ratio == document["cage_ratio"]


N, RATE_HZ = 4096, 20_480.0
TIMES, X, Y = np.arange(N) / RATE_HZ, files.vibration(N), files.vibration(N, 1)
SINGLE = 1e-6  # digits of single precision


def structure(label, values, block="bearing/Sensor"):
    return {"values": values, "dimensions": 1.0, "label": label, "blockName": block}


SIGNALS = np.empty(2, dtype=object)
SIGNALS[:] = [structure("acc_x [m/s^2]", X[:, None]), structure("acc_y [m/s^2]", Y.reshape(1, 1, -1))]


@pytest.mark.parametrize(
    ("contents", "channel", "settings"),
    [
        ({"out": {"time": TIMES[:, None], "signals": SIGNALS, "blockName": "bearing/Scope"}}, "acc_y [m/s^2]", {}),
        ({"out": {"time": TIMES[:, None], "signals": structure("", np.stack([X, Y], 1))}}, "Sensor[2]", {"unit": "g"}),
        ({"tout": TIMES[:, None], "yout": np.stack([X, Y], axis=1)}, "yout[2]", {"unit": "g"}),
        ({"ScopeData": np.stack([TIMES, X, Y], axis=1)}, "ScopeData[3]", {"unit": "g"}),
        ({"ans": np.stack([TIMES, X, Y])}, "ans[3]", {"unit": "g"}),  # block "To File": times in the first row
    ],
)
def test_simulink(tmp_path, contents, channel, settings):
    savemat(tmp_path / "out.mat", contents)
    with pytest.raises(DataError, match="which of 2 channels"):
        load(tmp_path / "out.mat", **settings)
    found = load(tmp_path / "out.mat", channel=channel, **settings)
    assert found.fs_hz == pytest.approx(RATE_HZ)
    np.testing.assert_allclose(found.channels[channel], Y * (9.80665 if settings else 1.0))


def test_times_of_the_channel_that_is_chosen(tmp_path):
    """Two blocks record at two rates."""
    slow = {"time": np.arange(1000) / 2e3, "signals": structure("slow", X[:1000])}
    savemat(tmp_path / "out.mat", {"a": slow, "b": {"time": TIMES, "signals": structure("fast", X)}}, oned_as="column")
    rates = [load(tmp_path / "out.mat", unit="m/s2", channel=name).fs_hz for name in ("slow", "fast")]
    assert rates == pytest.approx([2e3, RATE_HZ])


def test_objects_of_matlab(tmp_path, monkeypatch):
    """Without mat-io the error states two remedies; with mat-io a timeseries is read."""
    monkeypatch.setitem(sys.modules, "matio", None)
    with pytest.raises(DataError, match=r"need the library mat-io \(.*install mat-io\)\. A signal x can also be"):
        add_objects(tmp_path, {})
    assert "left out" in add_objects(tmp_path, {"x": X})[0]

    def made(**properties: Any) -> SimpleNamespace:
        return SimpleNamespace(properties=properties)

    info = made(Time_=np.zeros((0, 0)), Start_=np.zeros((1, 1)), Increment_=np.full((1, 1), 1 / RATE_HZ))
    series = made(Data_=X[:, None], TimeInfo=info, Name=np.array(["acc"]))
    contents = {"log": made(Elements=files.nested(made(Values=series)))}
    monkeypatch.setitem(sys.modules, "matio", SimpleNamespace(load_from_mat=lambda _: contents))
    found: dict[str, Any] = {}
    assert add_objects(tmp_path, found) == ()
    np.testing.assert_array_equal(found["log.Elements.Values"][:, 0], X)
    np.testing.assert_allclose(found["log.Elements.Values.time [s]"], TIMES, rtol=SINGLE)


@pytest.mark.filterwarnings("ignore:duration_to_mat")
def test_a_timetable_that_mat_io_wrote(tmp_path):
    matio, pd = pytest.importorskip("matio"), pytest.importorskip("pandas")
    table = pd.DataFrame({"acc_x": X}, index=pd.Index(pd.to_timedelta(TIMES, unit="s"), name="Time"))
    for version in ("v7", "v7.3"):
        path = tmp_path / f"{version}.mat"
        matio.save_to_mat(str(path), {"log": table}, version=version)
        found = load(path, unit="m/s2")
        assert found.fs_hz == pytest.approx(RATE_HZ, rel=1e-5)
        np.testing.assert_array_equal(signal(found), X)


def letters(*texts):
    longest = max(map(len, texts))
    return np.array([list(text.ljust(longest)) for text in texts])


def modelica(path, layout, times=TIMES):
    """Write a result with a parameter, two variables, and an alias of the second variable with a changed sign."""
    names = ("Time", "bearing.d", "ring.a[1]", "ring.a[2]", "ring.f", "ring.phi")
    described = ("Time in [s]", "Diameter [m]", "Acceleration [m/s2|m/s2]", "[m/s2]", "", "[rad]")
    info = np.array([[0, 1, 0, -1], [1, 1, 0, 0], [2, 2, 0, -1], [2, 3, 0, -1], [2, -3, 0, -1], [2, 4, 0, -1]])
    contents = {
        "name": letters(*names),
        "description": letters(*described),
        "dataInfo": info.astype(np.int32),
        "data_1": np.array([[0.3], [0.3]]),
        "data_2": np.stack([times, X, Y, 30 * times], axis=1).astype(np.float32 if layout == "binNormal" else float),
    }
    if layout == "binTrans":
        contents = {name: np.ascontiguousarray(value.T) for name, value in contents.items()}
    savemat(path, {"Aclass": letters("Atrajectory", "1.1", "", layout)} | contents, format="4", appendmat=False)
    return path


@pytest.mark.parametrize("layout", ["binTrans", "binNormal"])
def test_modelica(tmp_path, layout):
    path = modelica(tmp_path / "dsres", layout)
    with pytest.raises(DataError, match=r"no channel 'ring.b'; it has ring.a\[1\], ring.a\[2\], ring.f, ring.phi"):
        load(path, channel="ring.b")
    found = load(path, channel="ring.a[2]", cage_channel="ring.phi", rpm=600.0)
    assert (found.origin, found.unit, found.fs_hz) == (Origin.SIMULATED, "m/s2", pytest.approx(RATE_HZ, rel=1e-4))
    np.testing.assert_allclose(found.channels["ring.a[2]"], Y, rtol=SINGLE)
    assert found.cage_ratio == pytest.approx(30 / (2 * np.pi) / 10, rel=1e-5)
    np.testing.assert_allclose(load(path, channel="ring.f", unit="m/s2").channels["ring.f"], -Y, rtol=SINGLE)


def test_modelica_s_table_of_hundreds_of_columns(tmp_path):
    names = ["time", *(f"body.r[{i},{i + 1}]" for i in range(300))]
    with (tmp_path / "res.csv").open("w") as stream:
        stream.write(",".join(f'"{name}"' for name in names) + "\n")
        csv.writer(stream).writerows(np.column_stack([TIMES[:300], *[np.round(X[:300], 4)] * 300]).tolist())
    assert load(tmp_path / "res.csv", channel="body.r[7,8]", unit="g").samples == 300
    with pytest.raises(DataError, match=r"no channel 'body.r\[7,9\]'; it has .*Did you mean 'body.r"):
        load(tmp_path / "res.csv", channel="body.r[7,9]")


PULSES_HZ = 25600.0
SECONDS = 4.0
START_HZ, RISE_HZ_PER_S = 20.0, 2.5  # a ramp: 20 to 30 Hz
TIME = np.arange(round(SECONDS * PULSES_HZ)) / PULSES_HZ
TURNS = START_HZ * TIME + RISE_HZ_PER_S * TIME**2 / 2
MEAN_HZ = TURNS[-1] / TIME[-1]
# of the speed, at its two ends where the spline has one neighbour only: half a turn of the ramp is 2.5e-3
COURSE = 2e-3
SPREAD = 0.01  # ten whole waves, sampled 400 times each, and a sensor without noise
RAMP_HZ = 1e-3  # quarters of 1000 samples of a ramp of 1 Hz
COVERED = (176, 198)  # 200 intervals: 88 to 99 %


def pulses(per_rev, *, width=0.1):
    """Square signal, high for the fraction `width` of each pulse."""
    return np.where((TURNS * per_rev + 0.3) % 1 < width, 4.8, 0.2)


@pytest.mark.parametrize(("per_rev", "width"), [(1, 0.02), (60, 0.5), (2.5, 0.98)])
def test_a_ramp(per_rev, width):
    speed, signal, count = speed_from_pulses(pulses(per_rev, width=width), PULSES_HZ, per_rev)
    assert count == pytest.approx(per_rev * TURNS[-1], abs=1)
    at = np.arange(signal.values_hz.size) / signal.rate_hz
    assert at[-1] == pytest.approx(SECONDS, rel=1e-6)
    inside = (at > 0.1) & (at < SECONDS - 0.1)
    np.testing.assert_allclose(signal.values_hz[inside], (START_HZ + RISE_HZ_PER_S * at)[inside], rtol=COURSE)
    assert speed.source is SpeedSource.TACHOMETER
    assert abs(speed.value_hz - MEAN_HZ) <= speed.ci95_hz
    assert speed.drift_hz == pytest.approx(RISE_HZ_PER_S * SECONDS * 0.75, rel=0.05)  # quarters are that far apart


def test_the_interval_holds_under_noise():
    """The interval of a steady 25 Hz, one noisy sine per turn sampled at 2 kHz, contains the true speed."""
    rng, inside, time = np.random.default_rng(1), 0, np.arange(8000) / 2000.0
    for _ in range(200):
        signal = np.sin(2 * np.pi * (25.0 * time + rng.uniform())) + rng.normal(0, 0.05, time.size)
        speed, *_ = speed_from_pulses(signal, 2000.0, 1.0)
        inside += abs(speed.value_hz - 25.0) <= speed.ci95_hz
    assert inside >= 180  # 95 % are 190; 994 of 1000 were counted, for the ends' share is generous


def without_one():
    signal = pulses(1.0)
    first = round(float(pulse_times(signal)[20]))
    signal[first - 5 : first + 300] = 0.2
    return signal


@pytest.mark.parametrize(
    ("signal", "said"),
    [
        (without_one(), r"1 of \d+ intervals between pulses .* pulses are missing"),
        (np.ones(1000), "signal is constant"),
        (pulses(1.0)[:3000], r"pulses, 1 per turn, are .* turns of the shaft; 4 are needed"),
    ],
)
def test_missing_pulses_and_none(signal, said):
    with pytest.raises(DataError, match=said):
        speed_from_pulses(signal, PULSES_HZ, 1.0)


def test_a_channel_beside_the_vibration(tmp_path):
    path, acc = tmp_path / "a.npz", np.random.default_rng(0).normal(0, 1, TIME.size)
    np.savez(path, fs=np.array(PULSES_HZ), acc_unit=np.array("g"), acc=acc, key=pulses(2.0))
    for given, said in (
        ({}, r"which of 2 channels: --channel acc \| key; .*no shaft speed: .*--tacho"),
        ({"tacho": "none"}, r"no channel 'none'; it has acc, key"),
        ({"tacho": "key"}, r"tachometer key: the number of pulses .* is not stated: --pulses-per-rev N"),
        ({"tacho": "key", "pulses_per_rev": 1, "rpm": 1500}, r"300\d\S* rpm, but 1500 rpm are stated: check --puls"),
    ):
        with pytest.raises(DataError, match=said):
            load_recording(path, RecordingSettings(**given))
    found = load_recording(path, RecordingSettings(tacho="key", pulses_per_rev=2))
    assert (found.channel, found.unit, found.speed_signal is not None) == ("acc", "m/s2", True)
    assert found.speed.value_hz == pytest.approx(MEAN_HZ, rel=1e-3)
    assert any("speed from tachometer key, 200 pulses, 2 per revolution" in note for note in found.notes)
    assert load_recording(path, RecordingSettings(tacho="key", pulses_per_rev=2, rpm=1490)).speed == found.speed
    np.savez(path, fs=np.array(PULSES_HZ), acc_unit=np.array("g"), acc=acc, rpm=60 * (START_HZ + RISE_HZ_PER_S * TIME))
    found = load_recording(path, RecordingSettings(tacho="rpm"))  # a speed in place of pulses
    assert (found.channel, found.speed.value_hz) == ("acc", pytest.approx(MEAN_HZ, rel=1e-4))
    short = Recording(**vars(found) | {"speed_signal": SpeedSignal(values_hz=np.array([8.0, 9.0]), rate_hz=1000.0)})
    assert short.part(1000, TIME.size).speed_signal.values_hz == [9.0]  # the last value


def test_the_shaft_s_own_variation_is_no_error_of_the_record_s_mean():
    """The mean of a speed that varies by half a per cent is uncertain only by the clocks."""
    speed = tachometer_speed(14.3 * (1 + 0.005 * np.sin(2 * np.pi * 5 * np.arange(4096) / 2048)))
    assert speed.spread_hz == pytest.approx(0.005 * 14.3 / np.sqrt(2), rel=SPREAD)
    assert speed.ci95_hz == pytest.approx(SCALE_CI95 * 14.3, rel=SPREAD)


@pytest.mark.parametrize("smoothed", [15, 45, 91])
def test_noise_of_a_smoothed_signal_is_an_error_of_the_mean(smoothed, monkeypatch):
    """The speed from noisy angles (0.001 turns, 640 Hz) is smoothed over up to one revolution."""
    monkeypatch.setattr(speed_module, "SCALE_CI95", 0.0)
    rng, window, covered = np.random.default_rng(4), np.hanning(smoothed + 2)[1:-1], [0, 0]
    for _ in range(200):
        angle = 14.3 * np.arange(1280 + smoothed) / 640 + rng.normal(0, 1e-3, 1280 + smoothed)
        signal = np.convolve(np.diff(angle) * 640, window / window.sum(), "valid")
        for known, rate_hz in enumerate((None, 640.0)):
            speed = tachometer_speed(signal, rate_hz)
            covered[known] += abs(speed.value_hz - 14.3) < speed.ci95_hz
    assert covered[0] < COVERED[0] <= covered[1] <= COVERED[1]  # white noise alone explains too little


@pytest.mark.parametrize("direction", [1, -1])
def test_drift_and_direction(direction):
    speed = tachometer_speed(direction * np.linspace(10, 11, 1000))
    assert (speed.value_hz, speed.drift_hz) == (pytest.approx(10.5), pytest.approx(0.75, abs=RAMP_HZ))


@pytest.mark.parametrize("signal", [np.zeros(100), np.full(100, 1e5), np.ones(3)])
def test_what_is_no_shaft_speed(signal):
    with pytest.raises(DataError, match="speed signal"):
        tachometer_speed(signal)
