"""A machine's file stands for the options of the command line; scales of files, without which no level is compared."""

from pathlib import Path

import numpy as np
import pytest

from srbval import ConfigurationError, DataError, report_recordings
from srbval.diagnosis.machine import machine_options, machine_toml
from srbval.recordings import RecordingSettings
from srbval.recordings.registry import add, load_registered
from tests.reading.test_shaft_speed import FS_HZ, record
from tests.recordings import formats

ALL = {
    "bearing": "skf-6205",
    "rpm": 1500.0,
    "rpm_tolerance": 2.0,
    "radial_kn": 12.5,
    "axial_kn": -0.5,
    "channel": "DE",
    "fs": FS_HZ,
    "unit": "g",
    "scale": 5.0,
    "sensitivity": 100.0,
    "tacho": "T",
    "pulses_per_rev": 1.5,
    "healthy": "before.npy",
    "healthy_scale": 2.0,
    "baseline": 8,
    "band": [2000.0, 5000.0],
    "auto_band": True,
    "cage_slip": 3.0,
    "machine_class": "large-rigid",
    "zones_mm_s": [1.1, 2.8, 7.1],
}
REFUSED = {
    'bearing = "skf-6025"': "Did you mean 'skf-6205'",
    "[sensor]\nrate = 25600": "25600 has no unit",
    '[sensor]\nunit = "furlong"': "unit 'furlong' is not known; known: m/s2",
    '[set_point]\nspeed = "-3 rpm"': "must be positive",
    "[set_point]\nspeed_tolerance_pct = 20": "at most 10",
    '[limits]\nband = ["5 kHz", "2 kHz"]': "above the one before",
}


def test_options_written_to_a_file_are_read_from_it_again(tmp_path):
    """Every one of them, and in another folder with the paths of that."""
    folder = tmp_path / "other"
    folder.mkdir()
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
        pytest.importorskip("soundfile").write(
            path, samples / full, round(formats.FS_HZ), subtype="PCM_16", format="WAV"
        )
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
    for wrong, code, said in (
        (stated, 2, "--healthy-scale F"),
        (["--unit", "g"], 3, "without a scale: levels cannot be compared"),
    ):
        assert said in srbval_text("analyse", faulty, "--healthy", healthy, *GIVEN, *wrong, code=code).err
    assert ratio(healthy, "--unit", "unknown") < true / 1000  # shares of the mean do not depend on the gain
    settings = RecordingSettings(unit="g", fs_hz=formats.FS_HZ, rpm=60 * formats.SHAFT_HZ)
    alone = load_registered(faulty, settings)
    assert (alone.unit, alone.scale_missing) == ("unknown", True)
    with pytest.raises(DataError, match="cannot be compared"):
        report_recordings([alone], tmp_path / "r", bearing="skf-6205", healthy=load_registered(healthy, settings))
    add(healthy, settings=RecordingSettings(unit="mg", scale=1e3 * quiet_scale))
    assert ratio(healthy, *stated) == pytest.approx(true, rel=DIGITS)
