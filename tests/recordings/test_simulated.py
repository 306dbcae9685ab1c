"""Signals as solvers write them: even times, accelerations, cage and shaft; what does not fit is refused."""

import json
import os
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from srbval.cli import main
from srbval.errors import ConfigurationError, DataError
from srbval.reading.analyse import analyse
from srbval.recordings import Origin, Recording, RecordingSettings, SpeedSource, load_recording
from srbval.recordings.registry import add, load_registered
from srbval.recordings.simulated import differentiated, resampled

BAND_HZ = (500.0, 1500.0)
FS_HZ, SECONDS, STEP_S = 8000.0, 0.5, 5e-5
ENDS = 200  # samples at either end that the low-pass or the mirror image may spoil
SPLINE = 2e-4  # of a tone of 1 kHz at 20 uneven samples in a period: (2 pi / 20)^4 / 384 is 2.5e-5 for even ones
EXACT = 1e-6  # of the amplitude, away from the ends: nothing but rounding and the leakage of the window
AT_ENDS = 0.05  # of the amplitude, at the very ends
RATIO = 1e-5  # of a cage ratio, read without noise
HANDED = Path(os.environ.get("SRBVAL_RECORDINGS") or "/none", "..", "cases", "simulation")
TIMES = np.arange(1000) / 20_000


def uneven_times(step_s: float = STEP_S, seconds: float = SECONDS, seed: int = 0) -> np.ndarray:
    """Steps of 0.6 to 1.4 times the mean one."""
    steps = np.random.default_rng(seed).uniform(0.6, 1.4, round(seconds / step_s)) * step_s
    return np.concatenate(([0.0], np.cumsum(steps)))


def tones(times_s: np.ndarray, hz: tuple[float, ...] = (700.0, 1000.0)) -> np.ndarray:
    return np.sum([np.sin(2 * np.pi * f * times_s + i) for i, f in enumerate(hz)], axis=0)


def table(path: Path, comment: str = "", **columns: np.ndarray) -> Path:
    """A CSV file; two underscores in a name stand for brackets about a unit."""
    names = [f"{name} [{unit}]" if unit else name for name, _, unit in (key.partition("__") for key in columns)]
    rows = [",".join(f"{x:.12g}" for x in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join([*([comment] if comment else []), ",".join(names), *rows, ""]))
    return path


def load(path: Path, **settings: object) -> Recording:
    return load_recording(path, RecordingSettings(**settings))  # type: ignore[arg-type]


def test_uneven_times_become_even(tmp_path: Path) -> None:
    times = uneven_times()
    path = table(tmp_path / "a.csv", time=times, **{"acc__m/s2": tones(times)})
    with pytest.raises(DataError, match=r"no even times \(the times of time are uneven.*\): --resample HZ") as asked:
        load(path)
    assert "--fs" not in str(asked.value)
    with pytest.raises(DataError, match=r"uneven.*--fs would take them as even. Leave it out"):
        load(path, fs_hz=20_000.0, resample_hz=FS_HZ)
    found = load(path, resample_hz=FS_HZ, band_hz=BAND_HZ)
    assert (found.fs_hz, found.cautions) == (FS_HZ, ())
    true = tones(np.arange(found.samples) / FS_HZ)
    off = (found.channels["acc [m/s2]"] - true)[ENDS:-ENDS]
    assert np.abs(off).max() < SPLINE * 2
    assert 0.3 < found.resampling_error / (np.std(off) / np.std(true)) < 3  # the estimate, without the truth
    assert load(path, resample_hz=FS_HZ / 2, band_hz=BAND_HZ).samples == pytest.approx(found.samples / 2, abs=1)


def test_what_the_new_rate_does_not_hold_is_removed() -> None:
    """A tone above half of the new rate would appear at the difference of both."""
    times = uneven_times()
    assert np.abs(resampled(times, tones(times, (4500.0,)), FS_HZ)[ENDS:-ENDS]).max() < 1e-3


def test_events_are_written_twice(tmp_path: Path) -> None:
    """A solver writes both sides of a jump; digits of the same value a nanosecond apart are no slope."""
    times = np.sort(np.concatenate([uneven_times(), [0.1, 0.1, 0.2, 0.2 + 1e-9]]))
    values = tones(times) + 1e-4 * (np.arange(times.size) % 2)  # rounding of two written values
    found = load(table(tmp_path / "a.csv", t=times, **{"a__m/s2": values}), resample_hz=FS_HZ, band_hz=BAND_HZ)
    true = tones(np.arange(found.samples) / FS_HZ)
    assert np.abs(found.channels["a [m/s2]"] - true)[ENDS:-ENDS].max() < 1e-3


GAP = uneven_times()
GAP[200:] += 1e-3  # after about 10 ms
RISING = "export them again, rising, with all their digits and their unit"


@pytest.mark.parametrize(
    ("times", "settings", "said"),
    [
        (
            GAP,
            {"band_hz": BAND_HZ},
            r"a step of 0\.001\d+ s at 0\.0\d+ s is too long for 1500 Hz; the limit is .*--skip",
        ),
        (GAP, {}, r"a step of 0\.00\d+ s at .* too long for 3200 Hz"),
        (GAP, {"band_hz": BAND_HZ, "skip_s": 0.1}, ""),
        (GAP, {"band_hz": (50.0, 200.0)}, ""),
        (uneven_times(), {"band_hz": (500.0, 3500.0)}, r"keeps frequencies up to 3200 Hz.*resample to 8750 Hz or more"),
        (uneven_times(), {"resample_hz": 1e9}, r"--resample must be between 51\d and 16\d{4}\d* Hz|between .* Hz"),
        (uneven_times(), {"skip_s": 9.0}, r"it lasts 0\.5\d* s; without the first 9 s \(--skip\) 0 samples remain"),
        (uneven_times()[::-1].copy(), {}, RISING),
        (np.where(np.arange(GAP.size) == 9, 1.0, GAP), {}, RISING),
        (uneven_times() * 1e3, {}, RISING),  # a mean rate of 20 Hz if these were seconds
        (np.arange(GAP.size) / 20_000, {}, ""),  # even: as any record
        ((np.arange(GAP.size) / 20_000).round(6), {"band_hz": BAND_HZ}, ""),  # rounded digits are not uneven
    ],
)
def test_steps_that_do_not_carry_the_band(tmp_path: Path, times: np.ndarray, settings: dict, said: str) -> None:
    path, given = table(tmp_path / "a.csv", time=times, **{"a__m/s2": tones(times)}), {"resample_hz": FS_HZ} | settings
    if not said:
        assert load(path, **given).fs_hz == FS_HZ
        return
    with pytest.raises(DataError, match=said) as refused:
        load(path, **given)
    assert "--fs" not in str(refused.value)


def test_long_steps_are_said_where_no_band_is_known(tmp_path: Path) -> None:
    times = uneven_times(1.2e-4)
    found = load(table(tmp_path / "a.csv", time=times, **{"a__m/s2": tones(times)}), resample_hz=FS_HZ)
    assert any("reliable below 1" in caution for caution in found.cautions)


def test_even_samples_are_resampled_too(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", tones(np.arange(20_000) / 40_000))
    found = load(tmp_path / "a.npy", fs_hz=40_000.0, unit="m/s2", resample_hz=FS_HZ, band_hz=BAND_HZ)
    off = found.channels["data"] - tones(np.arange(found.samples) / FS_HZ)
    assert np.abs(off[ENDS:-ENDS]).max() < SPLINE
    same = load(tmp_path / "a.npy", fs_hz=40_000.0, unit="m/s2", resample_hz=40_000.0)
    assert (same.samples, same.resampling_error) == (20_000, None)


@pytest.mark.parametrize(("unit", "per_m"), [("m", 1.0), ("mm", 1e3), ("um", 1e6), ("m/s", 1.0), ("mm/s", 1e3)])
@pytest.mark.parametrize("drift", [0.0, 3.0])
def test_positions_and_velocities_become_accelerations(tmp_path: Path, unit: str, per_m: float, drift: float) -> None:
    """A cosine of 123.4 Hz, no whole number of periods in the record: sign, (2 pi f)^n and the ends, up to a drift."""
    times, hz = np.arange(10_000) / 20_000, 123.4
    rate = 2 * np.pi * hz
    if "/s" in unit:
        samples, acceleration = np.sin(rate * times) / rate + drift * times, np.cos(rate * times) + drift
    else:
        samples, acceleration = -np.cos(rate * times) / rate**2 + drift * times, np.cos(rate * times)
    found = load(table(tmp_path / "a.csv", **{"time__s": times, f"x__{unit}": per_m * samples}))
    assert (found.unit, found.fs_hz) == ("m/s2", pytest.approx(20_000))
    off = found.channels[found.channel or ""] - acceleration
    assert np.abs(off[ENDS:-ENDS]).max() < 1e-3
    assert np.abs(off).max() < AT_ENDS * 20


def test_noise_above_every_band_is_not_amplified() -> None:
    noise = np.random.default_rng(0).normal(size=20_000)
    power = np.abs(np.fft.rfft(differentiated(noise, 1.0, 2))) ** 2
    assert power[-500:].mean() < 1e-3 * power[power.size // 2 :].max()


@pytest.mark.parametrize(
    ("name", "settings", "unit"),
    [
        ("x", {"derivative": 2}, "derivative 2 of m"),
        ("x", {"derivative": 1}, "derivative 1 of m/s"),
        ("x", {"derivative": 2, "unit": "mm"}, "derivative 2 of mm"),
        ("x [mm]", {"derivative": 2}, "derivative 2 of mm"),
    ],
)
def test_a_derivative_states_the_unit_that_the_file_does_not(
    tmp_path: Path, name: str, settings: dict, unit: str
) -> None:
    rows = (f"{t:.6f},{t**2:.9f}" for t in TIMES)
    (tmp_path / "a.csv").write_text("\n".join([f"time [s],{name}", *rows]))
    assert any(unit in note for note in load(tmp_path / "a.csv", **settings).notes)


@pytest.mark.parametrize(
    ("unit", "settings", "said"),
    [
        ("m/s2", {"derivative": 1}, "derivative 1 of samples in m/s2; it must be 1 for m/s or 2 for m"),
        ("mm", {"derivative": 1}, "derivative 1 of samples in m;"),
        ("m/s", {"derivative": 2}, "derivative 2 of samples in m/s;"),
    ],
)
def test_a_derivative_that_contradicts_the_unit(tmp_path: Path, unit: str, settings: dict, said: str) -> None:
    with pytest.raises(DataError, match=said):
        load(table(tmp_path / "a.csv", **{"time__s": TIMES, f"x__{unit}": TIMES}), **settings)


@pytest.mark.parametrize("wrong", [{"derivative": 3}, {"resample_hz": 0.0}, {"skip_s": -1.0}])
def test_settings_that_are_impossible(wrong: dict) -> None:
    with pytest.raises(ConfigurationError, match="must be"):
        RecordingSettings(**wrong)


SHAFT_HZ, CAGE = 12.0, 0.4315


@pytest.mark.parametrize(
    ("key", "of_turns"),
    [
        ("cage__rad", lambda turns: 2 * np.pi * turns),
        ("cage__deg", lambda turns: 360 * turns % 360),  # wrapped
        ("cage_rad", lambda turns: -2 * np.pi * turns),  # the other way round
        ("cage__rpm", lambda turns: np.full(turns.size, 60 * CAGE * SHAFT_HZ)),
        ("cage__rad/s", lambda turns: np.full(turns.size, 2 * np.pi * CAGE * SHAFT_HZ)),
        ("cage_speed_hz", lambda turns: np.full(turns.size, CAGE * SHAFT_HZ)),
    ],
)
@pytest.mark.parametrize("resample_hz", [None, FS_HZ])
def test_cage_and_shaft_of_a_simulation(tmp_path: Path, key: str, of_turns: object, resample_hz: float | None) -> None:
    """The settling, in which the cage slips, is cut."""
    times = uneven_times() if resample_hz else np.arange(10_000) / 20_000
    turns = CAGE * SHAFT_HZ * times + 0.3 * np.clip(0.1 - times, 0, None)
    columns = {"a__m/s2": tones(times), key: of_turns(turns), "shaft__rad": 2 * np.pi * SHAFT_HZ * times}
    path = table(tmp_path / "a.csv", time__s=times, **columns)
    name = next(line for line in path.read_text().split("\n")).split(",")[2]
    given = {"resample_hz": resample_hz, "skip_s": 0.1, "band_hz": BAND_HZ, "cage_channel": name}
    found = load(path, **given, shaft_channel="shaft", origin=Origin.SIMULATED)
    assert found.cage_ratio == pytest.approx(CAGE, rel=RATIO)
    assert (found.speed.source, found.speed.ci95_hz) == (SpeedSource.PRESCRIBED, 0.0)
    assert found.speed.value_hz == pytest.approx(SHAFT_HZ, rel=RATIO)
    assert found.seconds == pytest.approx(times[-1] - 0.1, abs=2 * STEP_S)
    assert list(found.channels) == ["a [m/s2]"]
    by_rpm = load(path, **given, rpm=60 * SHAFT_HZ, channel="a", origin=Origin.SIMULATED)
    assert by_rpm.cage_ratio == pytest.approx(CAGE, rel=RATIO)
    assert (by_rpm.speed.source, load(path, **given, channel="a").cage_ratio) == (SpeedSource.PRESCRIBED, None)


def test_a_rotation_needs_its_unit(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", time__s=TIMES, **{"a__m/s2": tones(TIMES), "cage": TIMES, "b__g": TIMES})
    unstated = "cage is no angle or speed by its unit, which is not stated; one of rad"
    for name, said in (("cage", unstated), ("b", "g; one of rad")):
        with pytest.raises(DataError, match=said):
            load(path, channel="a", cage_channel=name, unit="m/s2" if name == "cage" else None)
    with pytest.raises(DataError, match="no channel 'kage'; it has"):
        load(path, channel="a", cage_channel="kage")


def write_csv(path: Path, said: str) -> None:
    table(
        path, f"# origin = {said}", **{"time__s": np.arange(1000) / 20_000, "a__m/s2": tones(np.arange(1000) / 20_000)}
    )


def write_hdf5(path: Path, said: str) -> None:
    with h5py.File(path, "w") as file:
        file["a"] = tones(TIMES)
        file.attrs.update({"fs": 20_000.0, "unit": "m/s2", "origin": said})


def write_matlab(path: Path, said: str) -> None:
    savemat(
        path, {"a": tones(np.arange(1000) / 20_000), "fs": 20_000.0, "unit": "m/s2", "origin": said}, appendmat=False
    )


@pytest.mark.parametrize("write", [write_csv, write_hdf5, write_matlab])
def test_nothing_simulated_is_declared_measured(tmp_path: Path, write: object) -> None:
    write(tmp_path / "sim", "Simulated by a multibody code")  # type: ignore[operator]
    write(tmp_path / "rig", "test bench")  # type: ignore[operator]
    assert [load(tmp_path / name).origin for name in ("sim", "rig")] == [Origin.SIMULATED, Origin.MEASURED]
    with pytest.raises(DataError, match="states that it is simulated; it cannot be declared measured"):
        load(tmp_path / "sim", origin=Origin.MEASURED)
    add(tmp_path / "rig", settings=RecordingSettings(origin=Origin.SIMULATED, rpm=1500.0, skip_s=0.01))
    found = load_registered(tmp_path / "rig")
    assert (found.origin, found.speed.ci95_hz, found.samples) == (Origin.SIMULATED, 0.0, 800)


def test_options_and_columns_of_a_table_are_the_same_settings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times = uneven_times(seconds=2.0)
    columns = {"x__mm": tones(times), "cage__rad": 2 * np.pi * CAGE * 25 * times}
    file = str(table(tmp_path / "a.csv", time__s=times, **columns))
    given = ["--resample", "8000", "--derivative", "2", "--skip", "0.25", "--cage-channel", "cage"]
    record = ["--origin", "simulated", "--bearing", "skf-6205", "--rpm", "1500", "--json"]
    assert main(["analyse", file, "--band", "500", "1500", *given, *record]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["origin"], document["fs_hz"]) == ("simulated", 8000)
    assert document["cage_ratio"] == pytest.approx(CAGE, rel=RATIO)
    assert 0 < document["resampling_error"] < SPLINE
    labels = tmp_path / "labels.csv"
    labels.write_text(
        "file;resample;derivative;skip;cage_channel;origin;band\na.csv;8000;2;0,25;cage;simulated;500 1500"
    )
    assert main(["data", "add", str(tmp_path), "--table", str(labels), *record[2:]]) == 0
    (entry,) = json.loads(capsys.readouterr().out)["recordings"]
    assert (entry["origin"], entry["fs_hz"], entry["reason"]) == ("simulated", 8000, None)
    assert load_registered(file).cage_ratio == pytest.approx(CAGE, rel=RATIO)


@pytest.mark.parametrize("name", ["variable_step", "uniform_step", "mujoco_outer", "mujoco_inner"])
def test_the_handed_simulations(name: str) -> None:
    """Lines and cage ratios that the makers of the files state."""
    path = HANDED / f"{name}.csv"
    if not path.is_file():
        pytest.skip("no folder of handed simulations beside SRBVAL_RECORDINGS")
    settings = {"rpm": 710.0, "band_hz": BAND_HZ, "origin": Origin.SIMULATED, "resample_hz": 20_480.0}
    if name.startswith("mujoco"):
        found = load(path, **settings, channel="acc_y", cage_channel="cage_angle")
        assert found.cage_ratio == pytest.approx({"outer": 0.43154, "inner": 0.43078}[name[7:]], abs=2e-5)
    else:
        line = analyse(load(path, **settings), bearing="skf-22240", band_hz=BAND_HZ).line("BPFO")
        assert line.detected
        assert line.found_hz == pytest.approx(96.9, abs=0.02)
