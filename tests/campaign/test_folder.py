"""Folders of campaigns, damaged, in use, full or someone else's: nothing is lost or run twice; a data set of one."""

import errno
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pandas
import pytest
import xarray

import srbval
from srbval.campaign.results import TIMED_OUT, CaseResult, read_case_result, write_result
from srbval.campaign.run import CAMPAIGN_JSON, RESULTS_CSV, campaign_status, folder_lock, result_path
from srbval.errors import ConfigurationError, DataError
from tests.campaign.campaigns import content, damaged_names, good_results, resume, run_small, small


def foreign(path):
    with h5py.File(path, "w") as file:
        file["value"] = [1.0, 2.0]


DAMAGES: dict[str, Callable[[Path], object]] = {
    "cut": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "zeros added": lambda path: path.write_bytes(path.read_bytes() + bytes(100)),
    "loop": lambda path: (path.unlink(), path.symlink_to(path.name)),
    "foreign": foreign,
    "another case": lambda path: shutil.copy(next(p for p in good_results(path.parents[1]) if p != path), path),
}


def test_damaged_results_are_named_and_run_again(whole, folder, srbval_json):
    """`verify` names each, `status` does not count it; the other bits of a file: `test_every_byte_counts`."""
    first, *others = good_results(folder)
    for damage in DAMAGES.values():
        first.unlink()
        damage(Path(shutil.copy(whole / "cases" / first.name, first)))
        found = srbval_json("campaign", "verify", folder, code=3)
        assert (found["ok"], found["status"]) == (False, "damaged")
        assert [one["file"] for one in found["damaged"]] == [str(first)]
        assert campaign_status(folder)["done"] == 5
        assert (srbval.load_campaign(folder).to_xarray()["status"] == "missing").sum() == 1
    for path in others:
        DAMAGES["cut"](path)
    again = resume(folder)
    assert (again["done"], again["ran"]) == (6, 3)
    assert content(folder) == content(whole)
    assert damaged_names(folder) == set()


@pytest.mark.parametrize("in_its_place", [Path.mkdir, os.mkfifo])
def test_a_folder_or_pipe_in_a_results_place_stays(in_its_place, folder):
    path = good_results(folder)[0]
    path.unlink()
    in_its_place(path)
    assert damaged_names(folder) == {path.name}
    with pytest.raises(DataError, match=f"{path.name}: a device, a pipe or a folder"):
        resume(folder)
    assert path.exists()


def test_results_that_are_gone_and_results_to_try_again(whole, folder):
    gone, late, _ = good_results(folder)
    gone.unlink()
    (folder / RESULTS_CSV).unlink()
    write_result(late, CaseResult(key=late.stem, status=TIMED_OUT, reason="too long"))
    status = campaign_status(folder)
    assert (status["done"], sorted(entry["status"] for entry in status["failed"])[-1]) == (5, "timed-out")
    assert resume(folder)["ran"] == 2
    assert content(folder) == content(whole)


def test_status_counts_inaccurate_cases_and_the_table_has_a_row_for_each(folder, srbval_text):
    changed = good_results(folder)[0]
    write_result(changed, replace(read_case_result(changed), status="inaccurate", reason="the step is too long"))
    text = srbval_text("campaign", "status", folder).out
    assert all(f"1 {how}" in text for how in ("inaccurate", "load-lost", "x inaccurate: the step is too long (case "))
    table = pandas.read_csv(folder / RESULTS_CSV)
    assert list(table["case"]) == list(range(6))
    assert (table["status"] == "inaccurate").sum() == 1
    assert list(table["bpfo_hz"].notna()) == [True] * 3 + [False] * 3


def test_verify_reads_all_and_writes_nothing(folder, srbval_json):
    """Also results of an earlier form of the campaign, which stay."""
    resume(folder, seed=7)
    before = {path: path.stat().st_mtime_ns for path in [folder, *folder.rglob("*")]}
    found = srbval_json("campaign", "verify", folder)
    assert (found["ok"], found["damaged"]) == (True, [])
    assert found["results"] == len(list((folder / "cases").glob("*.h5"))) > 6
    assert {path: path.stat().st_mtime_ns for path in before} == before
    srbval_json("campaign", "verify", folder.parent / "none", code=3)


def test_a_damaged_table_of_cases(whole, folder):
    DAMAGES["cut"](folder / CAMPAIGN_JSON)
    assert damaged_names(folder) == {CAMPAIGN_JSON}
    with pytest.raises(DataError, match=r"damaged .*keep the results"):
        campaign_status(folder)
    with pytest.raises(ConfigurationError, match="belongs to another campaign than 'other'"):
        resume(folder, name="other")
    assert resume(folder)["ran"] == 0
    assert content(folder) == content(whole)


@pytest.mark.parametrize("name", [CAMPAIGN_JSON, RESULTS_CSV])
def test_a_folder_with_anothers_files_is_left_alone(name, tmp_path):
    """As after ``-o .`` in a folder with a table of that name."""
    (tmp_path / name).write_text('{"name": "small", "theirs": 1}\n')
    with pytest.raises(ConfigurationError, match="nothing was changed"):
        resume(tmp_path)
    with pytest.raises(DataError, match=r"damaged|contains no campaign"):
        campaign_status(tmp_path)
    assert (tmp_path / name).read_text() == '{"name": "small", "theirs": 1}\n'


def test_a_users_own_files_stay(folder):
    own = [folder / "notes.h5", folder / "cases" / "notes.txt", folder / ".x.part"]
    for path in own:
        path.write_text("mine")
    resume(folder)
    assert [path.read_text() for path in own] == ["mine"] * len(own)


def test_two_campaigns_in_one_folder(folder):
    with folder_lock(folder):
        with pytest.raises(ConfigurationError, match="another campaign runs in this folder"):
            resume(folder)
        assert campaign_status(folder)["running"]
    assert not campaign_status(folder)["running"]


def test_a_disk_that_is_too_small_is_seen_before(tmp_path, monkeypatch):
    monkeypatch.setattr("srbval.campaign.run.shutil.disk_usage", lambda _: type("usage", (), {"free": 1000}))
    with pytest.raises(DataError, match=r"6 results will take .* MB are free"):
        run_small(small(), tmp_path)


def test_a_disk_that_fills_up(tmp_path, monkeypatch):
    room = iter(range(3))  # for the table of cases and two results

    def fill(_):
        if next(room, None) is None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr("srbval.storage.files.os.fsync", fill)
        with pytest.raises(DataError, match=r"No space left on device.* 2 of 6 cases .* are done and kept"):
            run_small(small(), tmp_path)
    assert (campaign_status(tmp_path)["done"], campaign_status(tmp_path)["failed"]) == (2, [])
    assert run_small(small(), tmp_path)["ran"] == 4


def test_a_campaign_is_one_data_set(whole, tmp_path):
    """Swept inputs are coordinates; every case has its status; signals are those of accurate cases."""
    campaign = srbval.load_campaign(whole)
    data = campaign.to_xarray(signals=True)
    assert data["status"].values[3:].tolist() == ["load-lost", "refused", "refused"]
    assert data["defect.kind"].values.tolist() == ["outer", "inner", "", "", "", ""]
    assert data["load.radial"].values.tolist() == ["", "", "", "100 MN", "-3 kN", ""]
    assert data["state"].values[:3].tolist() == ["outer", "inner", "healthy"]
    assert data["cage_ratio"].attrs["units"] == "1"
    for case, file in ((case, result_path(whole, case.key)) for case in campaign.cases[:3]):
        with h5py.File(file) as stored:
            own = data["acceleration_y_m_s2"].sel(case=case.index)
            assert np.array_equal(own.values, stored["acceleration_y_m_s2"][:])
            assert own.attrs["units"] == "m s-2"
    assert bool(data["acceleration_y_m_s2"].sel(case=[3, 4, 5]).isnull().all())
    assert "split training and test by case" in data.attrs["use"]
    data.to_netcdf(tmp_path / "campaign.nc", engine="h5netcdf")
    with xarray.open_dataset(tmp_path / "campaign.nc", engine="h5netcdf") as stored:
        assert stored.identical(data)
    assert campaign.to_frame()["cage_ratio"].iloc[0] == data["cage_ratio"].values[0]


def test_commands(srbval_json, tmp_path):
    file, out = tmp_path / "two.toml", tmp_path / "run"
    file.write_text(
        'name = "two"\noutputs = ["acceleration"]\n[scene]\nduration = "5 ms"\nsettle = "0 s"\nmodel = "planar"\n'
        '[[axes]]\nkind = "grid"\nvalues = { "load.radial" = ["1 kN", "-1 kN"] }\n'
    )
    found = srbval_json("campaign", "run", file, "-o", out, "--dry-run")
    assert (found["cases"], found["refused"], found["models"]) == (2, 1, {"planar": 1})
    assert not out.exists()
    found = srbval_json("campaign", "run", file, "-o", out, "--jobs", "1", code=1)
    assert (found["cases"], found["done"], found["engine"]) == (2, 2, "local")
    assert [entry["status"] for entry in found["failed"]] == ["refused"]
    found = srbval_json("campaign", "status", out)
    assert (found["done"], found["running"]) == (2, False)
