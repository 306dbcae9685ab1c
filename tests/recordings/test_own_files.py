"""Runs written to HDF5, read back through the same loader."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings import Origin, SpeedSource, load_recording

from . import files


def run_file(path: Path, **attributes: object) -> Path:
    defaults = {"schema_version": 1, "srbval_kind": "run", "name": "a run", "fs_hz": 61440.0, "unit": "m/s2"}
    more = {"bearing": "skf-22240", "state": "outer", "shaft_speed_hz": 11.8333, "radial_n": 124800.0}
    with h5py.File(path, "w") as file:
        file.attrs.update(defaults | more | attributes)
        for i, axis in enumerate("xyz"):
            file[f"acceleration_{axis}_m_s2"] = files.vibration(seed=i)
        file["cage_speed_rad_s"] = files.vibration(seed=9)
    return path


def test_run_becomes_a_simulated_recording_with_two_axes(tmp_path: Path) -> None:
    r = load_recording(run_file(tmp_path / "run.h5"))
    assert (r.origin, r.axes, r.channel, r.unit) == (Origin.SIMULATED, ("x", "y"), None, "m/s2")
    assert (r.fs_hz, r.state, r.bearing, r.radial_n) == (61440.0, Fault.OUTER, "skf-22240", 124800.0)
    assert (r.speed.value_hz, r.speed.source) == (11.8333, SpeedSource.PRESCRIBED)
    np.testing.assert_array_equal(r.channels["z"], files.vibration(seed=2))
    assert load_recording(tmp_path / "run.h5", channel="y").axes is None


SCENES = ("[" * 50_000, '{"speed_profile": 1' + "0" * 5000 + "}", "[]", '{"speed_profile": [[]]}')


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({"srbval_kind": "other"}, "srbval_kind is 'other'"),
        ({"state": "rusty"}, "state 'rusty'"),
        ({"status": "cage-lost", "reason": "the cage stopped"}, r"run failed \(cage-lost: the cage stopped\)"),
        *(({"scene": scene}, "scene stored with the run") for scene in SCENES),
    ],
)
def test_run_that_cannot_be_read(tmp_path: Path, attributes: dict[str, object], message: str) -> None:
    with pytest.raises(DataError, match=message):
        load_recording(run_file(tmp_path / "run.h5", **attributes))
