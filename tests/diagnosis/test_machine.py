"""A machine's file stands for options of the command line; scales of files; its trend, with as many alarms as said."""

import math
import re
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval import ConfigurationError, DataError, report
from srbval.cli.machine_file import machine_options, machine_toml
from srbval.monitoring.trend import ALPHA, Trend, trend_of, zone_boundaries
from srbval.reading.features import velocity_rms
from srbval.recordings import RecordingSettings
from srbval.recordings.file_times import record_times
from srbval.recordings.registry import add, recording_of
from tests.reading.test_shaft_speed import FS_HZ, record
from tests.recordings import formats

ALL = {"bearing": "skf-6205", "rpm": 1500.0, "rpm_tolerance": 2.0, "radial_kn": 12.5, "axial_kn": -0.5, "channel": "DE"}
ALL |= {"fs": FS_HZ, "unit": "g", "scale": 5.0, "sensitivity": 100.0, "tacho": "T", "pulses_per_rev": 1.5}
ALL |= {"healthy": "before.npy", "healthy_scale": 2.0, "baseline": 8, "band": [2000.0, 5000.0], "auto_band": True}
ALL |= {"cage_slip": 3.0, "machine_class": "large-rigid", "zones_mm_s": [1.1, 2.8, 7.1]}
REFUSED = {
    'bearing = "skf-6025"': "bearing 'skf-6025' is not known",
    'fs_hz = "25600 Hz"': r"unit 'Hz' of '25600 Hz' .* known: none \(the number alone\), %",
    'unit = "furlong"': "unit 'furlong' is not known; known: m/s2",
    "rpm = 1480\nrpm_tolerance_pct = 20": "at most 10",
    "zones_mm_s = [2, 2, 3]": "the velocities must increase",
    "baseline = 4": "must be at least 5",
    '[set_point]\nspeed = "1 rpm"': "unknown key",
}


def test_options_written_to_a_file_are_read_from_it_again(tmp_path):
    """Every one of them, and in another folder with the paths of that."""
    (folder := tmp_path / "other").mkdir()
    (folder / "m.toml").write_text(machine_toml("m", ALL | {"healthy": str(tmp_path / "before.npy")}, folder))
    read = machine_options(folder / "m.toml")
    assert Path(read.pop("healthy")).resolve() == tmp_path / "before.npy"
    assert read == {name: value for name, value in ALL.items() if name != "healthy"}


@pytest.mark.parametrize("text", REFUSED)
def test_what_it_cannot_mean_is_refused(text, tmp_path):
    """With the file, the value and what is known."""
    path = tmp_path / "m.toml"
    path.write_text(f'title = "pump"\n{text}\n')
    with pytest.raises(ConfigurationError, match=REFUSED[text]) as error:
        machine_options(path)
    assert str(error.value).startswith(str(path))


def test_it_says_what_the_options_say_and_they_go_over_it(tmp_path, srbval_json):
    """A speed on the command line is not the set point, so the set point's tolerance is not that speed's."""
    file, machine = str(tmp_path / "run.npy"), str(tmp_path / "m.toml")
    np.save(file, record(shaft_hz=25.0, seed=1, fault=True).channels["x"])
    given = f"--elements 9,7.94,39.04,0 --rpm 1500 --fs {FS_HZ:g} --unit g --band 2000 5000".split()

    tolerant = srbval_json("analyse", file, *given, "--rpm-tolerance", "2", "--write-machine", machine)
    assert srbval_json("analyse", file, "--machine", machine) == tolerant
    assert tolerant["bearing"] == "elements 9,7.94,39.04,0"
    at_speed = srbval_json("analyse", file, "--machine", machine, "--rpm", "1500")
    assert at_speed == srbval_json("analyse", file, *given) != tolerant


HALF = 2**15 - 1
DIGITS = 0.01  # of a ratio: 16 bits of each record's own range, in a band with a part of its power
GIVEN = f"--bearing skf-6205 --band 1400 2800 --rpm {60 * formats.SHAFT_HZ} --fs {formats.FS_HZ}".split()


def written(path: Path, samples: np.ndarray, kind: str) -> tuple[str, float]:
    """The file in which the largest sample is 0.9 of full scale, and its scale [g]."""
    full = float(np.abs(samples).max()) / 0.9
    if kind == "wav":
        write = pytest.importorskip("soundfile").write
        write(path, samples / full, round(formats.FS_HZ), subtype="PCM_16", format="WAV")
        return str(path), full
    with path.open("wb") as file:
        np.save(file, np.round(samples / full * HALF).astype("i2") if kind == "counts" else samples)
    return str(path), full / HALF if kind == "counts" else 1.0


@pytest.mark.parametrize("kind", ["wav", "counts"])
def test_levels_of_files_of_unlike_full_scale(kind, tmp_path, srbval_json, srbval_text):
    """The healthy record is a hundredth as strong, and fills its file as the faulty one does."""

    def ratio(healthy: str, *options: str) -> float:
        return srbval_json("analyse", faulty, "--healthy", healthy, *GIVEN, *options)["fault"]["ratio"]

    quiet, loud = formats.record()[0] / 100, formats.record()[1]
    faulty, _ = written(tmp_path / "f.npy", loud, "numbers")
    true = ratio(written(tmp_path / "h.npy", quiet, "numbers")[0], "--unit", "g")
    (faulty, scale), (healthy, quiet_scale) = written(tmp_path / "f", loud, kind), written(tmp_path / "h", quiet, kind)
    stated = ["--unit", "g", "--scale", str(scale)]
    assert ratio(healthy, *stated, "--healthy-scale", str(quiet_scale)) == pytest.approx(true, rel=DIGITS)
    unlike = "without a scale, so levels cannot be compared"
    for wrong, code, said in ((stated, 2, "--healthy-scale F"), (["--unit", "g"], 3, unlike)):
        assert said in srbval_text("analyse", faulty, "--healthy", healthy, *GIVEN, *wrong, code=code).err
    assert ratio(healthy, "--unit", "unknown") < true / 1000  # shares of the mean do not depend on the gain
    settings = RecordingSettings(unit="g", fs_hz=formats.FS_HZ, rpm=60 * formats.SHAFT_HZ)
    alone = recording_of(faulty, settings)
    assert (alone.unit, alone.scale_missing) == ("unknown", True)
    with pytest.raises(DataError, match="cannot be compared"):
        report(alone, folder=tmp_path / "r", bearing="skf-6205", healthy=recording_of(healthy, settings))
    add(healthy, settings=RecordingSettings(unit="mg", scale=1e3 * quiet_scale))
    assert ratio(healthy, *stated) == pytest.approx(true, rel=DIGITS)


HISTORIES, RECORDS, BASELINE, SNAPSHOT = 200, 25, 6, 1200
STATED = ["--fs", f"{FS_HZ:g}", "--rpm", "1500", "--unit", "m/s2", "--bearing", "skf-6205", "--band", "2000", "5000"]


def document(number: int, levels: np.ndarray, *, rpm: float = 1500.0, channel: str = "x") -> dict[str, Any]:
    """What `read_records` says of a record, as far as a trend needs it; levels of three lines and the RMS."""
    names = ("BPFO", "BPFI", "2xBSF")
    features = {"unit": "m/s2", "rms": levels[3], "band_rms": 1.0, "velocity_rms_mm_s": None}
    features["velocity_missing"] = "not sampled fast enough"
    lines = [{"name": n, "harmonic": 1, "depth": x**2, "snr": 10.0} for n, x in zip(names, levels, strict=False)]
    where = {"file": f"{number:04}.npy", "channel": channel, "shaft_hz": {"value": rpm / 60}}
    return where | {"features": features, "lines": lines}


def healthy(rng: np.random.Generator, kind: str) -> np.ndarray:
    """Levels of a machine that stays as it is: lognormal, or the highest of twenty bins of noise."""
    if kind == "lognormal":
        return np.asarray(np.exp(0.3 * rng.standard_normal((RECORDS, 4))))
    return np.asarray(np.sqrt(rng.exponential(size=(RECORDS, 4, 20)).max(axis=2)))


def trend(levels: np.ndarray, **changes: Any) -> Trend:
    documents = [document(number, one) for number, one in enumerate(levels)]
    return trend_of(documents, {one["file"]: float(n) for n, one in enumerate(documents)}, **changes)


@pytest.mark.parametrize("kind", ["lognormal", "noise"])
def test_false_alarms_in_the_whole_history(kind):
    """At most alpha of healthy histories have one; the bound is not so loose that it means nothing."""
    rng = np.random.default_rng(7)
    alarms = sum(trend(healthy(rng, kind), baseline=BASELINE).alarm is not None for _ in range(HISTORIES))
    share, scatter = alarms / HISTORIES, math.sqrt(ALPHA * (1 - ALPHA) / HISTORIES)
    assert share <= ALPHA + 3 * scatter
    assert kind == "noise" or share > ALPHA / 5  # comparisons share the baseline, so alpha is not reached


def test_a_growing_defect_is_found_and_a_drop_is_not():
    levels = healthy(np.random.default_rng(1), "lognormal")
    levels[:, 3] = 1.0 + 0.01 * np.arange(RECORDS) % 0.03
    growing = levels.copy()
    growing[10:, 1] *= np.exp(0.5 * np.arange(RECORDS - 10))
    found = trend(growing, baseline=10)
    assert found.alarm is not None
    assert found.alarm.first_alarm is not None
    assert 10 < found.alarm.first_alarm < 18
    assert all("BPFI" in point["risen"] for point in found.alarm.points[18:])
    since = next(n for n, point in enumerate(found.alarm.points) if "BPFI" in point["risen"])
    rise = found.alarm.rise_db(found.alarm.points[-1]["levels"], "BPFI")
    shown = f"{rise:+.1f} dB since {since} (record {since + 1} of 25)"
    headline = f"Alarm: inner race line (BPFI) of x {shown}, over its limit"
    assert found.answer.startswith(headline)
    growing[5:, 3] *= 3.0  # the RMS rises first, and the line is still what the headline names
    found = trend(growing, baseline=5)
    assert "Alarm: inner race line (BPFI) of x " in found.answer
    assert "; first alarm: RMS at 5; " in found.answer
    assert trend(np.where(np.arange(4) == 3, growing, levels), baseline=5).answer.startswith("Alarm: RMS of x +9.")
    falling = levels.copy()
    falling[10:, 1] /= np.exp(0.5 * np.arange(RECORDS - 10))
    assert trend(falling, baseline=10).answer.startswith("No alarm in 25 records: ")


@pytest.mark.parametrize("others", [(1, 15), (1, 3, 15)])
def test_another_speed_is_neither_judged_nor_baseline_and_few_records_are_not_either(others):
    levels = healthy(np.random.default_rng(2), "lognormal")
    levels[[*others]] *= 1000
    documents = [document(n, one, rpm=1800.0 if n in others else 1500.0) for n, one in enumerate(levels)]
    found = trend_of(documents, {one["file"]: float(n) for n, one in enumerate(documents)}, baseline=BASELINE)
    (channel,) = found.channels
    assert (channel.points[15]["risen"], channel.points[15]["comparable"]) == ([], False)
    assert found.comparisons == (4 * (RECORDS - BASELINE - 1) if len(others) == 2 else 0)
    assert max(channel.limits.values(), default=0.0) < 30
    assert trend(levels[:4]).answer.startswith("No alarm can be computed from 4 records")
    with pytest.raises(ConfigurationError, match="at least 5"):
        trend(levels, baseline=4)


def test_when_a_record_was_made(tmp_path):
    dates = ["2003.10.22.12.06.24", "pump_20031023T0809.wav"]
    assert list(record_times(dates)[0].values()) == [datetime(2003, 10, 22, 12, 6, 24), datetime(2003, 10, 23, 8, 9)]
    assert record_times(["run2.npy", "run10.npy"])[0] == {"run2.npy": 2.0, "run10.npy": 10.0}
    table = tmp_path / "times.csv"
    table.write_text("file,time\na.npy,2026-11-24 13:55\nb.npy,2026-11-25\n")
    times, said = record_times(["x/a.npy", "x/b.npy"], table)
    assert times == {"x/a.npy": datetime(2026, 11, 24, 13, 55), "x/b.npy": datetime(2026, 11, 25)}
    assert said == "the column time of times.csv"
    with pytest.raises(ConfigurationError, match="columns file and time"):
        record_times(["x/c.npy"], table)


@pytest.mark.parametrize(("frequency_hz", "within"), [(50.0, True), (5.0, False), (1500.0, False)])
def test_velocity_of_a_tone(frequency_hz, within):
    """An acceleration of amplitude a at f is a velocity of RMS a / (2 pi f sqrt 2)."""
    tone = 3.0 * np.sin(2 * np.pi * frequency_hz * np.arange(20_000) / 10_000.0) + 1.0
    expected = 3.0 / (2 * np.pi * frequency_hz * math.sqrt(2))
    found = velocity_rms(tone, 10_000.0, (10.0, 1000.0))
    assert found == pytest.approx(expected, rel=1e-3) if within else found < 0.01 * expected


DAYS = 9


def test_a_history_from_files_to_a_page(tmp_path, srbval_json, srbval_text):
    folder = tmp_path / "pump"
    folder.mkdir()
    for day in range(DAYS):
        quiet, faulty = (record(shaft_hz=25.0, seed=day, fault=fault).channels["x"] for fault in (False, True))
        np.save(folder / f"2026-11-{day + 1:02}.npy", quiet + max(0, day - 5) * (faulty - quiet))
    (folder / "2026-11-20.npy").write_bytes(b"")
    table, page = tmp_path / "trend.csv", tmp_path / "trend.html"
    command = ["trend", str(folder), *STATED, "--baseline", "5", "--machine-class", "medium-rigid"]
    shown = srbval_text(*command, "--export", table, "--plot", page, code=3)
    assert shown.out.startswith("Alarm: inner race line (BPFI) of data +")
    assert "dB since 2026-11-" in shown.out
    assert "not read: " in shown.err
    assert all(len(line) <= 80 for line in shown.out.splitlines()[3:] if "  " in line)
    assert len(table.read_text().splitlines()) == 1 + DAYS
    text = page.read_text()
    assert "data:image/svg+xml" in text
    assert "Channel data. Above" in text
    assert not re.search(r"""(src|href)=["']?http""", text)
    (channel,) = srbval_json(*command, code=3)["trend"]["channels"]
    assert [point["time"][:10] for point in channel["points"]] == [f"2026-11-{day:02}" for day in range(1, DAYS + 1)]
    assert {point["zone"] for point in channel["points"]} <= set("ABCD")
    machine = tmp_path / "pump.toml"
    machine.write_text('title = "pump"\nmachine_class = "medium-rigid"\n', encoding="utf-8")
    said = srbval_text("analyse", folder / f"2026-11-{DAYS:02}.npy", *STATED, "--machine", machine).out
    last = channel["points"][-1]
    wanted = f"zone {last['zone']} of ISO 20816-3, medium-rigid: velocity {last['velocity_rms_mm_s']:.2f} mm/s RMS"
    assert f"\n{wanted}, 10 to 1000 Hz\n" in said


def test_snapshots_of_a_tenth_of_a_second_are_pooled_for_lines(tmp_path, srbval_json, srbval_text):
    """Each is too short to search for lines, and is still refused as a record of its own."""
    quiet, faulty = (record(shaft_hz=25.0, seed=3, fault=fault).channels["x"] for fault in (False, True))
    for number, start in enumerate(range(0, quiet.size, SNAPSHOT)):
        growth = max(0.0, number - 15) / 3
        samples = quiet + growth * (faulty - quiet)
        np.save(tmp_path / f"snap{number:03}.npy", samples[start : start + SNAPSHOT])
    command = ["trend", tmp_path, *STATED[:-3]]
    assert srbval_text(*command).out.startswith("Alarm: inner race line (BPFI) of data +")
    found = srbval_json(*command)["trend"]
    assert found["time_from"].endswith("; 30 snapshots, pooled for lines")
    assert len(found["channels"][0]["points"]) == 12
    said = srbval_text("analyse", tmp_path / "snap000.npy", *STATED[:-3], code=3).err
    assert "at least 8 revolutions are needed" in said


def test_zones_rise_with_the_velocity_and_the_class():
    one = document(0, np.ones(4))
    one["features"] |= {"velocity_rms_mm_s": 5.0, "velocity_missing": ""}
    for name, zone in (("medium-rigid", "D"), ("medium-flexible", "C"), ("large-flexible", "B"), ("large-rigid", "C")):
        low, middle, high = zone_boundaries(name)
        assert low < middle < high
        assert trend_of([one], {one["file"]: 0.0}, machine_class=name).channels[0].points[0]["zone"] == zone
