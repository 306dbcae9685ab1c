"""A machine's file stands for the options of the command line, and what it cannot mean is refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval.cli import main
from srbval.diagnosis.machine import machine_options, machine_toml
from srbval.errors import ConfigurationError
from tests.reading.test_shaft_speed import FS_HZ, record

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


def test_options_written_to_a_file_are_read_from_it_again(tmp_path: Path) -> None:
    """Every one of them, and in another folder with the paths of that."""
    folder = tmp_path / "other"
    folder.mkdir()
    (folder / "m.toml").write_text(machine_toml("m", ALL | {"healthy": str(tmp_path / "before.npy")}, folder))
    read = machine_options(folder / "m.toml")
    assert Path(read.pop("healthy")).resolve() == tmp_path / "before.npy"
    assert read == {name: value for name, value in ALL.items() if name != "healthy"}


@pytest.mark.parametrize("text", REFUSED)
def test_what_it_cannot_mean_is_refused(text: str, tmp_path: Path) -> None:
    """With the file, the value and what is known."""
    path = tmp_path / "m.toml"
    path.write_text(f'title = "pump"\n{text}\n')
    with pytest.raises(ConfigurationError, match=REFUSED[text]) as error:
        machine_options(path)
    assert str(error.value).startswith(str(path))


def test_it_says_what_the_options_say_and_they_go_over_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A speed on the command line is not the set point, so the set point's tolerance is not that speed's."""
    file, machine = str(tmp_path / "run.npy"), str(tmp_path / "m.toml")
    np.save(file, record(shaft_hz=25.0, seed=1, fault=True).channels["x"])
    given = f"--elements 9,7.94,39.04,0 --rpm 1500 --fs {FS_HZ:g} --unit g --band 2000 5000".split()

    def analysed(*options: str) -> dict[str, Any]:
        assert main(["analyse", file, "--json", *options]) == 0
        found: dict[str, Any] = json.loads(capsys.readouterr().out)
        return found

    tolerant = analysed(*given, "--rpm-tolerance", "2", "--write-machine", machine)
    assert analysed("--machine", machine) == tolerant
    assert tolerant["bearing"] == "elements 9,7.94,39.04,0"
    assert analysed("--machine", machine, "--rpm", "1500") == analysed(*given) != tolerant
