"""Names and labels that attack whoever shows them: loaded and registered as plain text."""

import json
import os
from pathlib import Path

import h5py
import numpy as np
import pytest

from srbval.cli import main
from srbval.recordings import load_recording
from srbval.recordings.registry import FileStatus, add, verify

from . import files

SCRIPT = "<script>alert('\"1\"')</script>"
NASTY = [
    SCRIPT, "../../etc/passwd", "a" * 10_000, "x\x1b[2Jy\nz\x00", "' OR 1=1; --", "{{7*7}}$(touch bad)", "\u202egnp.x",
]  # fmt: skip
GIVEN = ["--bearing", "skf-6205", "--band", "500", "3000"]


def hostile_hdf5(path: Path, nasty: str) -> Path:
    with h5py.File(path, "w") as file:
        file.attrs["fs_hz"], file.attrs["unit"], file.attrs["rpm"] = 8000.0, "g", 1200.0
        file.attrs["name"] = file.attrs["label"] = nasty.replace("\0", "")
        file[nasty.replace("\0", "").replace("/", "_").replace(".", "_")] = files.vibration()
    return path


def test_loads_and_registers_under_a_plain_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    paths = [hostile_hdf5(tmp_path / f"{i}.h5", nasty) for i, nasty in enumerate(NASTY)]
    for path in paths:
        channel = load_recording(path).channel or ""
        assert channel.isprintable()
        assert 0 < len(channel) <= 80
    assert {entry.status for entry in add(tmp_path).recordings} == {FileStatus.OK}
    assert main(["data", "list"]) == 0
    assert "\x1b" not in capsys.readouterr().out
    assert main(["data", "list", "--json"]) == 0
    json.loads(capsys.readouterr().out)
    for path in (paths[0], paths[3]):  # markup; control characters
        assert main(["analyse", str(path), *GIVEN]) in (0, 3)  # half a second may be too short, but is no crash
        assert "\x1b" not in "".join(capsys.readouterr())
    assert sorted(p.name for p in tmp_path.iterdir() if p.is_file()) == [path.name for path in paths]


@pytest.mark.parametrize("name", [b"\xff\xfe.npy", b"a\x1b[2J\nb.npy", "Prüfstand é 日本.npy".encode()])
def test_names_of_files(name: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Not UTF-8, control characters: registered, verified, analysed, shown and removed."""
    path = tmp_path / os.fsdecode(name)
    try:
        np.save(path, files.vibration(40_000))
    except OSError:
        pytest.skip("this file system has no such names")
    stated = ["--rpm", "1500", "--fs", "8000", "--unit", "g", "--bearing", "skf-6205"]
    assert main(["data", "add", str(tmp_path), *stated]) == 0
    assert [entry.status for entry in verify().recordings] == [FileStatus.OK]
    assert main(["data", "list"]) == main(["analyse", str(path), *GIVEN]) == 0
    assert "\x1b" not in "".join(capsys.readouterr())
    for command in (["analyse", str(path), *GIVEN], ["data", "remove", str(path)]):
        assert main([*command, "--json"]) == 0
        document = json.loads(capsys.readouterr().out)
        assert document.get("file", document.get("recordings", [{}])[0].get("file")) == str(path)
    assert verify().recordings == ()


def test_own_file_with_hostile_texts(tmp_path: Path) -> None:
    """A run's name and bearing come from attributes: a path in them leads nowhere."""
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file.attrs.update({"srbval_kind": "stand-in", "fs_hz": 8000.0, "name": SCRIPT + "b" * 10_000})
        file.attrs.update({"bearing": "../../../secret.toml", "state": "outer"})
        file["acceleration_m_s2"] = files.vibration()
    recording = load_recording(tmp_path / "run.h5")
    assert recording.bearing is None
    assert len(recording.name) <= 80
