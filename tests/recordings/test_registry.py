"""The register: add, list, verify, remove; atomic, shared between processes, a changed byte caught."""

import os
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.campaign.folder import CampaignTable, folder_lock, write_table
from srbval.errors import DataError
from srbval.recordings import Origin, RecordingSettings
from srbval.recordings.registry import (
    FileStatus,
    add,
    find_recording,
    listing,
    register,
    remove,
    rig_recordings,
    verify,
)
from srbval.recordings.registry.manifest import manifest_path, read_manifest
from srbval.report.blocks import Report, Tone, VerdictBox
from srbval.report.write import write_report
from tests.campaign.campaigns import small
from tests.recordings.synthetic_record import write_synthetic_record

from . import files

INTERFACE_KEYS = {"file", "dataset", "state", "radial_kn", "axial_kn", "nominal_rpm"}
INTERFACE_KEYS |= {"fs_hz", "seconds", "sha256", "status"}
RIG, EXCERPT = "IR_727rpm_124.8kN_0kN.mat", "OR_353rpm_x.mat"


@pytest.fixture
def folder(tmp_path):
    """A rig excerpt, a full rig recording, a CWRU record and a stand-in; a readme."""
    folder = tmp_path / "data"
    (folder / "below").mkdir(parents=True)
    files.excerpt(folder / EXCERPT, condition="OR", rpm_nominal=353)
    files.rig_v5(folder / "below" / RIG, files.rig_signals())
    files.cwru(folder / "105.mat", "105")
    write_synthetic_record(folder / "s.h5", state=Fault.INNER, shaft_hz=14.3, seconds=0.2, seed=1)
    (folder / "README.md").write_text("Recordings of a rig, two of them.\n")
    return folder


def by_name(recordings):
    return {Path(r.file).name: r for r in recordings}


def statuses(recordings):
    return {Path(r.file).name: r.status for r in recordings}


def test_every_recording_is_described(folder, srbval_json):
    reported = []
    result = add(folder, progress=lambda *call: reported.append(call))
    found = by_name(result.recordings)
    assert statuses(found.values()) == dict.fromkeys((RIG, EXCERPT, "105.mat", "s.h5"), FileStatus.OK)
    rig = found[RIG]
    assert (rig.dataset, rig.state, rig.radial_kn, rig.axial_kn) == ("torino-full", Fault.INNER, 124.8, 0.0)
    assert (rig.nominal_rpm, rig.fs_hz, rig.seconds) == (727.0, 20480.0, pytest.approx(0.2))
    assert (found["s.h5"].origin, found["s.h5"].dataset) == (Origin.STAND_IN, None)
    (readme,) = result.left_out
    assert (Path(readme.file).name, "not a table of numbers" in (readme.reason or "")) == ("README.md", True)
    assert (result.problems, reported[-1]) == ((), ("Register", 1.0))
    assert listing().recordings == verify().recordings == result.recordings
    document = srbval_json("data", "list")
    assert {"schema_version", "status", "recordings", "manifest"} <= set(document)
    assert all(set(r) >= INTERFACE_KEYS for r in document["recordings"])
    grids = {covered["dataset"]: covered for covered in document["coverage"]}
    assert (len(grids["torino-full"]["points"]), grids["torino-full"]["missing"]) == (160, 159)
    there = [point for point in grids["torino-excerpts"]["points"] if point["files"]]
    assert [(point["state"], point["nominal_rpm"]) for point in there] == [("outer", 353.0)]


def test_a_changed_file_keeps_its_hash_until_it_is_registered_again(folder, srbval_json):
    first = by_name(add(folder).recordings)["105.mat"]
    path, data = folder / "105.mat", bytearray((folder / "105.mat").read_bytes())
    before = path.stat()
    data[20000] ^= 1
    path.write_bytes(data)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))  # size and time are those of the registration
    changed = by_name(verify().problems)["105.mat"]
    assert (changed.status, "when registered" in (changed.reason or "")) == (FileStatus.CHANGED, True)
    srbval_json("data", "verify", code=1)
    files.cwru(path, "105", rpm=1700)
    assert statuses(listing().problems) == {"105.mat": FileStatus.CHANGED}
    again = by_name(add(folder).recordings)["105.mat"]
    assert (again.status, again.sha256) == (FileStatus.CHANGED, first.sha256)
    anew = by_name(add(folder, repin=True).recordings)["105.mat"]
    assert (anew.status, anew.sha256 != first.sha256, verify().problems) == (FileStatus.OK, True, ())
    (folder / "s.h5").unlink()
    path.write_bytes(path.read_bytes()[:1000])
    for result in (listing(), verify()):
        assert statuses(result.problems) == {"s.h5": FileStatus.MISSING, "105.mat": FileStatus.TRUNCATED}


def test_recordings_of_the_rig(folder):
    assert rig_recordings() == ()
    add(folder)
    assert [Path(r.file).name for r in rig_recordings()] == [RIG, EXCERPT]
    assert find_recording(state=Fault.OUTER, nominal_rpm=353).dataset == "torino-excerpts"
    assert find_recording(state=Fault.HEALTHY, nominal_rpm=353) is None
    files.excerpt(folder / "OR_877rpm_sample.mat")
    entry = by_name(add(folder).recordings)["OR_877rpm_sample.mat"]
    assert (entry.status, "published 7c21237257b3" in (entry.reason or "")) == (FileStatus.CHANGED, True)


def test_environment_folder_is_there_without_add(folder, monkeypatch):
    """Files of a named folder are read once, and again after a change, but not registered."""
    monkeypatch.setenv("SRBVAL_RECORDINGS", str(folder))
    first = listing().recordings
    assert (len(first), {entry.registered for entry in read_manifest().values()}) == (4, {False})
    with monkeypatch.context() as patch:
        patch.setattr(register, "inspect_file", None)
        assert listing().recordings == first
    files.cwru(folder / "105.mat", "105", rpm=1700)
    (folder / "README.md").write_text("Other words.\n")
    (folder / "s.h5").unlink()
    assert (len(listing().recordings), listing().problems) == (3, ())
    assert {Path(file).name for file in read_manifest()} == {"105.mat", "README.md", EXCERPT, RIG}
    with pytest.raises(DataError, match=r"nothing was removed.*SRBVAL_RECORDINGS"):
        remove(folder)
    blocked = folder.parent / "file"
    blocked.write_text("a file where the home should be")
    monkeypatch.setenv("SRBVAL_HOME", str(blocked / "home"))
    assert len(rig_recordings()) == 2
    with pytest.raises(DataError, match="SRBVAL_HOME"):
        add(folder)
    monkeypatch.setenv("SRBVAL_RECORDINGS", str(folder / "none"))
    with pytest.raises(DataError, match="SRBVAL_RECORDINGS"):
        listing()
    monkeypatch.delenv("SRBVAL_RECORDINGS")
    assert listing().recordings == ()


def test_a_copy_is_no_further_recording(folder, tmp_path):
    shutil.copytree(folder, tmp_path / "copy")
    (tmp_path / "other name").symlink_to(folder)
    add(folder)
    alone = rig_recordings()
    add(tmp_path / "copy")
    add(tmp_path / "other name")
    assert len(listing().recordings) == 12
    assert rig_recordings() == tuple(replace(r, file=r.file.replace("/data/", "/copy/")) for r in alone)
    add(tmp_path / "copy" / "below", settings=RecordingSettings(rpm=700.0))  # stated differently
    assert len(rig_recordings()) == len(alone) + 1


@pytest.mark.parametrize("unit", [None, "g"])
def test_a_folder_that_moved(unit, folder, tmp_path):
    """Its old entries go, stored settings stay; files that went for good stay missing."""
    add(folder)
    add(folder / "below", settings=RecordingSettings(rpm=700.0))
    (folder / "105.mat").unlink()
    folder.rename(tmp_path / "moved")
    add(tmp_path / "moved", settings=RecordingSettings(unit=unit))
    found = by_name(listing().recordings)
    assert (len(listing().recordings), statuses(listing().problems)) == (4, {"105.mat": FileStatus.MISSING})
    assert found[RIG].settings == RecordingSettings(rpm=700.0, unit=unit)
    assert Path(found["s.h5"].file).parent == tmp_path / "moved"
    (tmp_path / "moved").rename(folder)
    add(folder, repin=True)
    assert (len(listing().recordings), statuses(listing().problems)) == (4, {"105.mat": FileStatus.MISSING})
    assert by_name(listing().recordings)[RIG].settings is None


def test_adds_at_once_lose_nothing(tmp_path):
    folders = [tmp_path / f"f{i}" for i in range(3)]
    for folder in folders:
        folder.mkdir()
        for j in range(5):
            np.save(folder / f"{j}.npy", files.vibration(300))
    with ThreadPoolExecutor(3) as pool:  # the lock is that of a file, for threads as for processes
        assert len(list(pool.map(add, folders))) == 3
    assert len(read_manifest()) == 15


@pytest.mark.recordings
def test_real_folder(recordings_dir, monkeypatch):
    """Every file is read, accused of nothing, or left out with its reason; a set of several channels asks for one."""
    monkeypatch.setenv("SRBVAL_RECORDINGS", str(recordings_dir))
    found = listing()
    assert (found.problems, {r.cautions for r in found.recordings}) == ((), {()})
    assert len(found.recordings) >= 50
    assert {Path(r.file).suffix for r in found.left_out} <= {".md", ".txt", ".json"}
    asked = sorted(Path(r.file) for r in found.recordings if "--channel" in (r.reason or ""))
    assert asked == sorted((recordings_dir / "ims_test1").glob("2003*"))
    states = ("H", "IR", "OR", "Roller")
    assert set(by_name(rig_recordings(nominal_rpm=877))) == {f"{state}_877rpm_sample.mat" for state in states}


def test_what_srbval_wrote_itself_is_no_recording(folder):
    """Tables that figures show and results of a campaign hold signals, too."""
    tone = VerdictBox(tone=Tone.NEUTRAL, headline="a report")
    report = Report(title="a", generated_utc=datetime.now(UTC), sections=(), data={}, verdict=tone)
    write_report(report, folder / "report", ("html", "json"))
    with folder_lock(folder / "below" / "runs"):
        write_table(folder / "below" / "runs", CampaignTable(campaign=small(), version="", cases=()))
    for name in ("report/figures/a.csv", "below/runs/results.csv", "below/runs/cases/a.h5"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(folder / "s.h5", folder / name)
    shutil.copy(folder / "s.h5", folder / "report" / "a_record_of_the_user.h5")
    found = add(folder)
    assert set(by_name(found.recordings)) == {EXCERPT, RIG, "105.mat", "s.h5", "a_record_of_the_user.h5"}
    reasons = [entry.reason or "" for entry in found.left_out]
    assert [sum(what in reason for reason in reasons) for what in ("of a report", "of a campaign")] == [3, 4]
    for none in (folder / "report" / "figures", folder / "README.md"):
        with pytest.raises(DataError, match="1 of 1 files to register are no recordings"):
            add(none)
    assert len(listing().recordings) == 5


def test_remove_undoes_an_add(folder, srbval_json, monkeypatch):
    add(folder / "105.mat")
    before = manifest_path().read_bytes()
    add(folder / "below")
    (removed,) = srbval_json("data", "remove", folder / "below")["recordings"]
    assert (Path(removed["file"]).name, set(removed) >= INTERFACE_KEYS) == (RIG, True)
    assert (manifest_path().read_bytes(), (folder / "below" / RIG).exists()) == (before, True)
    shutil.copy(folder / "105.mat", folder / "below" / "105.mat")
    add(folder)
    monkeypatch.chdir(folder.parent)
    with pytest.raises(DataError, match=r"or the name of several files; nothing was removed\. Give a path"):
        remove("105.mat")
    assert [len(remove(name).recordings) for name in ("s.h5", "cwru", folder)] == [1, 2, 2]
    with pytest.raises(DataError, match=r"s\.h5: no registered file, folder or data set.*nothing was removed"):
        remove("s.h5")


@pytest.mark.parametrize("content", [b"", b"[" * 200_000, b"\xff\xfe{}", b"null", b'{"recordings": [{"file": 5}]}'])
def test_a_damaged_register_is_refused(content, folder):
    add(folder)
    manifest_path().write_bytes(content)
    with pytest.raises(DataError, match=r"manifest\.json"):
        listing()
    assert "not a readable manifest" in listing(or_none=True).unreadable
