"""The register: add, list, verify, remove, settings of users, shipped recordings, and download of an open set."""

import os
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

from srbval.bearing import Fault, load_bearing
from srbval.campaign.run import CampaignTable, folder_lock, write_campaign_table
from srbval.errors import ConfigurationError, DataError
from srbval.reading.analyse import analyse
from srbval.recordings import Origin, RecordingSettings, SpeedSource, load_recording, registry
from srbval.recordings.datasets.description import dataset
from srbval.recordings.manifest import FileStatus, manifest_path, read_manifest
from srbval.recordings.registry import add, healthy_baseline, listing, recording_of, remove, rig_recordings
from srbval.report.blocks import Report, Tone, VerdictBox
from srbval.report.renderers import write_report
from srbval.storage.files import file_sha256
from srbval.storage.installation import shipped_folder
from tests.campaign.campaigns import small
from tests.recordings.synthetic_record import write_synthetic_record

from . import files

INTERFACE_KEYS = {"file", "dataset", "state", "radial_kn", "axial_kn", "nominal_rpm"}
INTERFACE_KEYS |= {"fs_hz", "seconds", "sha256", "status"}
RIG, EXCERPT = "IR_727rpm_124.8kN_0kN.mat", "OR_353rpm_x.mat"


@pytest.fixture
def folder(tmp_path):
    """Create a folder with a rig excerpt, a full rig recording, a CWRU record, a synthetic record and a readme."""
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


def test_every_recording_is_described(folder, srbval_json, srbval_text):
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
    assert listing().recordings == listing(hash_all=True).recordings == result.recordings
    shown = next(line for line in srbval_text("data", "list").out.splitlines() if "105.mat" in line)
    assert ("skf-6205" in shown, " 1797 " in shown) == (True, True)  # bearing and speed
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
    changed = by_name(listing(hash_all=True).problems)["105.mat"]
    assert (changed.status, "when registered" in (changed.reason or "")) == (FileStatus.CHANGED, True)
    srbval_json("data", "verify", code=1)
    files.cwru(path, "105", rpm=1700)
    assert statuses(listing().problems) == {"105.mat": FileStatus.CHANGED}
    again = by_name(add(folder).recordings)["105.mat"]
    assert (again.status, again.sha256) == (FileStatus.CHANGED, first.sha256)
    anew = by_name(add(folder, repin=True).recordings)["105.mat"]
    assert (anew.status, anew.sha256 != first.sha256, listing(hash_all=True).problems) == (FileStatus.OK, True, ())
    (folder / "s.h5").unlink()
    path.write_bytes(path.read_bytes()[:1000])
    for result in (listing(), listing(hash_all=True)):
        assert statuses(result.problems) == {"s.h5": FileStatus.MISSING, "105.mat": FileStatus.TRUNCATED}


def test_recordings_of_the_rig(folder):
    assert rig_recordings() == ()
    add(folder)
    assert [Path(r.file).name for r in rig_recordings()] == [RIG, EXCERPT]
    files.excerpt(folder / "OR_877rpm_sample.mat")
    entry = by_name(add(folder).recordings)["OR_877rpm_sample.mat"]
    assert (entry.status, "published 7c21237257b3" in (entry.reason or "")) == (FileStatus.CHANGED, True)


def test_environment_folder_is_there_without_add(folder, monkeypatch):
    """Files in the folder of SRBVAL_RECORDINGS are read once, and again after a change, but not registered."""
    monkeypatch.setenv("SRBVAL_RECORDINGS", str(folder))
    first = listing().recordings
    assert (len(first), {entry.registered for entry in read_manifest().values()}) == (4, {False})
    with monkeypatch.context() as patch:
        patch.setattr(registry, "inspect_file", None)
        assert listing().recordings == first
    files.cwru(folder / "105.mat", "105", rpm=1700)
    (folder / "README.md").write_text("Other words.\n")
    (folder / "s.h5").unlink()
    assert (len(listing().recordings), listing().problems) == (3, ())
    assert {Path(file).name for file in read_manifest()} == {"105.mat", "README.md", EXCERPT, RIG}
    with pytest.raises(DataError, match=r"nothing was removed.*SRBVAL_RECORDINGS"):
        remove(folder)
    monkeypatch.setenv("SRBVAL_HOME", str(folder / "105.mat" / "home"))  # within a file
    assert len(rig_recordings()) == 2
    with pytest.raises(DataError, match="SRBVAL_HOME"):
        add(folder)
    monkeypatch.setenv("SRBVAL_RECORDINGS", str(folder / "none"))
    with pytest.raises(DataError, match="SRBVAL_RECORDINGS"):
        listing()
    monkeypatch.delenv("SRBVAL_RECORDINGS")
    assert listing().recordings == ()


def test_a_file_that_another_version_has_read_is_read_again_once(folder):
    (first,) = add(folder / "105.mat").recordings
    written = manifest_path().read_text().replace('"rpm": 1796.0', '"rpm": 1.0')
    for program, rpm in (('"program": "', 1.0), ('"program": "older', first.rpm), ('"none": "', first.rpm)):
        manifest_path().write_text(written.replace('"program": "', program))
        assert listing().recordings == listing(hash_all=True).recordings == (replace(first, rpm=rpm),)
        assert read_manifest()[first.file].rpm == rpm


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
    """Every file is read without cautions, or left out with a reason; several channels are an open question."""
    monkeypatch.setenv("SRBVAL_RECORDINGS", str(recordings_dir))
    found = listing()
    assert (found.problems, {r.cautions for r in found.recordings}) == ((), {()})
    assert len(found.recordings) >= 50
    assert {Path(r.file).suffix for r in found.left_out} <= {".md", ".txt", ".json"}
    asked = sorted(Path(r.file) for r in found.recordings if "--channel" in (r.reason or ""))
    assert asked == sorted((recordings_dir / "ims_test1").glob("2003*"))
    fast = {name for name, r in by_name(rig_recordings()).items() if r.nominal_rpm == 877}
    assert fast == {f"{state}_877rpm_sample.mat" for state in ("H", "IR", "OR", "Roller")}


def test_what_srbval_wrote_itself_is_no_recording(folder):
    """Tables and signals of reports and campaigns are passed over, but not a record that a user put beside them."""
    report = Report(title="a", sections=(), data={}, verdict=VerdictBox(tone=Tone.NEUTRAL, headline="a report"))
    write_report(report, folder / "report", ("html", "json"))
    table = CampaignTable(campaign=small(), version="", cases=(), folder=folder / "below" / "runs")
    with folder_lock(table.folder):
        write_campaign_table(table)
    for name in ("report/figures/a.csv", "below/runs/results.csv", "below/runs/cases/a.h5", "report/of the user.h5"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(folder / "s.h5", folder / name)
    found = add(folder)
    assert set(by_name(found.recordings)) == {EXCERPT, RIG, "105.mat", "s.h5", "of the user.h5"}
    assert set(by_name(found.left_out)) == {"README.md"}
    assert [Path(entry.file).name for entry in add(folder / "report").recordings] == ["of the user.h5"]
    with pytest.raises(DataError, match=f"1 of 1 files to register are no recordings, the first: {folder}/README.md"):
        add(folder / "README.md")
    assert [Path(entry.file).name for entry in add(folder / "below" / "runs").recordings] == ["a.h5"]


def test_remove_undoes_an_add(folder, srbval_json, monkeypatch):
    add(folder / "105.mat")
    before = manifest_path().read_bytes()
    add(folder / "below")
    (removed,) = srbval_json("data", "remove", folder / "below")["recordings"]
    assert (Path(removed["file"]).name, set(removed) >= INTERFACE_KEYS) == (RIG, True)
    assert (manifest_path().read_bytes(), (folder / "below" / RIG).exists()) == (before, True)
    add(folder)
    monkeypatch.chdir(folder.parent)
    assert [len(remove(name).recordings) for name in ("data/s.h5", folder)] == [1, 3]
    with pytest.raises(DataError, match=r"s\.h5: nothing was removed, because no registered file or folder"):
        remove("data/s.h5")


@pytest.mark.parametrize("content", [b"", b"[" * 200_000, b"\xff\xfe{}", b"null", b'{"recordings": [{"file": 5}]}'])
def test_a_damaged_register_is_refused(content, folder):
    add(folder)
    manifest_path().write_bytes(content)
    for reads in (listing, rig_recordings, SHIPPED, partial(recording_of, folder / "s.h5")):
        with pytest.raises(DataError, match=r"manifest\.json: not a readable manifest .*Move it away"):
            reads()


GIVEN = {"fs_hz": 8000.0, "unit": "g", "bearing": "skf-6205", "rpm": 1500.0}
HEADER = "file;state;bearing;rpm;radial_kn;channel;fs;unit"


@pytest.fixture
def machine(tmp_path):
    """Create a folder with two files of two channels and one file of one channel."""
    (tmp_path / "rig").mkdir()
    for i, name in enumerate(("a.npy", "b.npy")):
        np.save(tmp_path / "rig" / name, np.stack([files.vibration(seed=2 * i + k) for k in range(2)], axis=1))
    np.save(tmp_path / "rig" / "one.npy", files.vibration())
    return tmp_path / "rig"


def labelled(machine, *rows, header=HEADER):
    path = machine.parent / "labels.csv"
    path.write_text("\n".join(["\ufeff" + header, *rows]) + "\n", encoding="utf-8")
    return path


def test_stated_once_and_stored(machine):
    path = machine / "a.npy"
    given = RecordingSettings(channel="data[2]", **GIVEN)
    (entry,) = add(path, settings=given).recordings
    assert (entry.status, entry.reason, entry.channel, entry.fs_hz) == (FileStatus.OK, None, "data[2]", 8000.0)
    for again in (add(path), listing(hash_all=True)):
        assert again.recordings[0].settings == given
    for recording in (recording_of(path), registry.load_entry(listing(hash_all=True).recordings[0])):
        assert (recording.channel, recording.fs_hz, recording.unit) == ("data[2]", 8000.0, "m/s2")
    with pytest.raises(DataError, match="lacks information"):
        load_recording(path)  # the plain loader does not use the register
    add(path, settings=RecordingSettings(fs_hz=9000.0))  # later options go over stored ones
    assert (recording_of(path).fs_hz, recording_of(path).channel) == (9000.0, "data[2]")
    assert recording_of(path, RecordingSettings(channel="data[1]")).channel == "data[1]"
    assert add(path, repin=True).recordings[0].settings is None


def test_an_option_that_one_file_of_a_folder_has_no_use_for(machine):
    *two, one = add(machine, settings=RecordingSettings(channel="data[2]", **GIVEN)).recordings
    assert [(entry.channel, entry.reason) for entry in two] == [("data[2]", None)] * 2
    assert one.status is FileStatus.UNREADABLE
    assert one.reason == "no channel 'data[2]'; it has data. Did you mean 'data'?"


def test_a_set_point_is_not_a_measured_speed(machine):
    path, given = machine / "one.npy", {"fs_hz": 8000.0, "unit": "g", "rpm": 1500.0}
    measured, nominal = load_recording(path, **given), load_recording(path, **given, rpm_tolerance_pct=2.0)
    assert (measured.speed.source, measured.speed.ci95_hz) == (SpeedSource.STATED, 1 / 60)
    assert (nominal.speed.source, nominal.speed.ci95_hz) == (SpeedSource.NOMINAL, 0.5)
    assert "set point kept within 2 %" in " ".join(nominal.notes)
    add(path, settings=RecordingSettings(**given, rpm_tolerance_pct=2.0))
    assert recording_of(path).speed == nominal.speed
    again = recording_of(path, RecordingSettings(rpm=1490.0))
    assert again.speed.source is SpeedSource.STATED  # the stored tolerance belongs to the stored speed


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"rpm_tolerance_pct": 1.0}, "a speed tolerance, 1 %, needs the speed: --rpm"),
        ({"rpm": 1500.0, "rpm_tolerance_pct": 11.0}, "rpm_tolerance_pct = 11 must be above 0 and at most 10"),
        ({"derivative": 3}, "derivative = 3 must be at least 1 and at most 2"),
        ({"resample_hz": 0.0}, "resample_hz = 0 must be above 0"),
        ({"skip_s": -1.0}, "skip_s = -1 must be at least 0"),
    ],
)
def test_impossible_settings(wrong, said):
    with pytest.raises(ConfigurationError, match=said):
        RecordingSettings(**wrong)


def test_a_table_of_labels(machine, srbval_json):
    """Files not named in the table are not registered; an empty field leaves the option of the command."""
    rows = ("a.npy;healthy;skf-6205;1480,5;2,5;data[2];25600;g", "b.npy;outer;skf-6205;1478;2,5;data[2];25600;")
    labels = labelled(machine, *rows)
    first, second = srbval_json("data", "add", machine, "--table", labels, "--unit", "m/s2")["recordings"]
    assert [Path(r["file"]).name for r in (first, second)] == ["a.npy", "b.npy"]
    assert (first["state"], first["bearing"], first["rpm"], first["radial_kn"]) == ("healthy", "skf-6205", 1480.5, 2.5)
    assert (first["settings"]["unit"], second["settings"]["unit"]) == ("g", "m/s2")
    assert (first["reason"], second["reason"]) == (None, None)
    faulty = recording_of(machine / "b.npy")
    assert (faulty.state, faulty.bearing, faulty.radial_n) == (Fault.OUTER, "skf-6205", 2500.0)
    assert (faulty.channel, Path(healthy_baseline(faulty).file).name) == ("data[2]", "a.npy")


def test_a_baseline_of_another_speed_load_bearing_or_channel_is_none(machine):
    same = GIVEN | {"channel": "data[1]", "rpm": 1480.0}
    add(machine / "b.npy", settings=RecordingSettings(**same, state=Fault.OUTER))
    for other in ({}, {"rpm": 1200.0}, {"bearing": "skf-6203"}, {"radial_kn": 1.0}, {"channel": "data[2]"}):
        add(machine / "a.npy", settings=RecordingSettings(**same | other, state=Fault.HEALTHY), repin=True)
        assert (healthy_baseline(recording_of(machine / "b.npy")) is None) == bool(other), other


WRONG_ROWS = ("a.npy;rusty;skf-6205;1;;;;", "none.npy;;;;;;;", "a.npy;outer;;fast;;;;", "a.npy;outer")
WRONG_ROWS += ("a.npy;;;1;;;;", "a.npy;;;2;;;;")


@pytest.mark.parametrize(
    ("header", "rows", "said"),
    [
        ("file;bearng", ("a.npy;x",), "unknown column 'bearng'; did you mean 'bearing'"),
        ("state", ("outer",), "'file' is required"),
        (
            HEADER,
            WRONG_ROWS,
            r"5 of 6 rows cannot be used: row 1: .*rusty.*row 2: .*none\.npy: no such file.*row 3: .*fast.*"
            r"row 4: the row has 2 fields, the header 8; .*row 6: a\.npy is named twice",
        ),
        (HEADER, ("a.npy;;skf-9999;;;;;",), "bearing 'skf-9999' is not known"),
    ],
)
def test_all_that_is_wrong_with_a_table_at_once(machine, header, rows, said):
    with pytest.raises(ConfigurationError, match=said):
        add(machine, table=labelled(machine, *rows, header=header))


FOLDER = shipped_folder("data_manifest/rig_excerpts")
SHIPPED = registry.shipped_recordings  # the function, which `conftest.py` replaces
POINTS = {(state, rpm) for state in Fault for rpm in (353.0, 877.0)}
MOST_BYTES = 2_000_000
SINGLE = 2.0**-24  # relative error of rounding to single precision
MEAN_SPEED = 1e-6  # relative: of the mean of every 32nd value
PUBLISHED_RPM = 6e-4  # the author's means are rounded to 0.001 rpm
SPEED_CI = 0.001  # a tachometer's mean over 2 s is known to better than a per mille
LINES = 2e-6  # relative: of a line's frequency, with the mean speed


def test_what_ships_is_small_and_says_where_it_comes_from():
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < MOST_BYTES
    licence = (FOLDER / "LICENSE.txt").read_text()
    assert "Copyright (c) 2025 Politecnico di Torino" in licence
    assert "The above copyright notice and this permission notice shall be included in all" in licence
    described = (FOLDER / "README.md").read_text()
    published = {file["name"]: file for file in dataset("torino-excerpts").files}
    packed = sorted(FOLDER.glob("*.h5"))
    assert len(packed) == len(POINTS)
    for path in packed:
        original = published[f"{path.stem}.mat"]
        assert original["used_for"]  # so that every point of the grid counts as opened
        with h5py.File(path) as file:
            assert f"{original['name']}, SHA-256 {original['sha256']}" in file.attrs["copy_of"]
            assert file.attrs["source"] == original["url"]
            assert file["acc_m_s2"].dtype == np.float32
        assert f"| `{path.name}` | `{original['name']}` | `{original['sha256']}` |" in described
        assert original["url"].split("/")[5] in described  # the commit


def test_they_serve_where_nothing_is_registered(tmp_path, monkeypatch):
    monkeypatch.setattr(registry, "shipped_recordings", SHIPPED)  # hidden from other tests
    found = rig_recordings()
    assert {(r.state, r.nominal_rpm) for r in found} == POINTS
    for entry in found:
        assert (entry.dataset, entry.origin, entry.radial_kn) == ("torino-excerpts", Origin.MEASURED, 124.8)
        recording = load_recording(entry.file)
        assert (recording.fs_hz, recording.unit, recording.seconds) == (20480.0, "m/s2", 2.0)
        assert recording.speed.source is SpeedSource.TACHOMETER
        assert any("compact copy of" in note and "SHA-256" in note for note in recording.notes)
    assert "OR_877rpm_sample.h5" in {Path(one.file).name for one in found}
    origin = dataset("torino-excerpts")
    assert "commit 946782ab" in origin.source
    assert "Copyright (c) 2025 Politecnico di Torino" in origin.licence
    (outer,) = (r for r in rig_recordings() if r.operating_point[::3] == (Fault.OUTER, 877))
    assert Path(healthy_baseline(load_recording(outer.file)).file).name == "H_877rpm_sample.h5"
    files.excerpt(tmp_path / "mine.mat", condition="OR", rpm_nominal=877)
    add(tmp_path)
    (own,) = (r for r in rig_recordings() if r.operating_point[::3] == (Fault.OUTER, 877))
    assert Path(own.file).name == "mine.mat"  # registered ones come first
    assert {(r.state, r.nominal_rpm) for r in rig_recordings()} == POINTS


@pytest.mark.recordings
def test_they_are_the_originals(recordings_dir):
    bearing, published = load_bearing("skf-22240"), dataset("torino-excerpts").published_speeds
    means = {(mean.state, mean.nominal_rpm): mean.mean_rpm for mean in published.means}
    for path in sorted(FOLDER.glob("*.h5")):
        compact, original = load_recording(path), load_recording(recordings_dir / "torino" / f"{path.stem}.mat")
        for fact in ("state", "bearing", "fs_hz", "unit", "radial_n", "axial_n", "nominal_rpm", "channel", "band_hz"):
            assert getattr(compact, fact) == getattr(original, fact), fact
        a, b = compact.channels["sensor_4"], original.channels["sensor_4"]
        np.testing.assert_allclose(a, b, rtol=SINGLE, atol=0)
        speed, every = compact.speed_signal, round(original.speed_signal.rate_hz / compact.speed_signal.rate_hz)
        assert speed.rate_hz == 640.0
        np.testing.assert_allclose(speed.values_hz, original.speed_signal.values_hz[::every], rtol=2 * SINGLE)
        mean_rpm = means[original.state, original.nominal_rpm]
        assert original.speed.value_hz * 60 == pytest.approx(mean_rpm, abs=PUBLISHED_RPM)
        assert 0 < original.speed.ci95_hz * 60 < SPEED_CI * mean_rpm
        assert compact.speed.value_hz == pytest.approx(original.speed.value_hz, rel=MEAN_SPEED)
        assert compact.speed.ci95_hz == pytest.approx(original.speed.ci95_hz, rel=0.05)
        if path.stem.startswith(("OR_", "IR_")):
            lines = [analyse(r, bearing=bearing).line_of(r.state or Fault.HEALTHY) for r in (compact, original)]
            assert lines[0].found_hz == pytest.approx(lines[1].found_hz, rel=LINES)


NAMES = ("H_877rpm_a.mat", "IR_877rpm_a.mat", "OR_877rpm_a.mat")


@pytest.fixture
def server(tmp_path, monkeypatch):
    """Serve the files of a folder in place of the network; `asked` lists the requests."""
    made, asked = tmp_path / "made", []
    made.mkdir()

    def download(_, url, output_file, *_others):
        asked.append(url)
        shutil.copy(made / url, output_file)

    monkeypatch.setattr("pooch.HTTPDownloader.__call__", download)
    written = [files.excerpt(made / name, condition=name.split("_")[0]) for name in NAMES]
    expected = tuple({"name": p.name, "sha256": file_sha256(p), "url": p.name} for p in written)
    described = replace(dataset("torino-excerpts"), files=expected)
    monkeypatch.setattr(registry, "dataset", lambda _: described)
    return SimpleNamespace(folder=made, asked=asked)


def test_what_cannot_be_fetched_and_the_way_out(tmp_path, monkeypatch):
    def no_network(**_):
        raise OSError("network is unreachable")

    monkeypatch.setattr("pooch.retrieve", no_network)
    with pytest.raises(DataError, match=r"network is unreachable.*data add"):
        registry.fetch("torino-excerpts", tmp_path)
    with pytest.raises(DataError, match=r"restricted.*data add"):
        registry.fetch("torino-full")
    with pytest.raises(DataError, match=r"no files to download.*Downloadable: torino-excerpts"):
        registry.fetch("upm-citef")
    with pytest.raises(ConfigurationError, match="data set 'nothing' is not known; known: cwru"):
        registry.fetch("nothing")


@pytest.mark.parametrize("damage", [lambda body: body[:5000], lambda body: body[:5000] + b"x" + body[5001:]])
def test_damaged_then_resumed_at_the_file_that_is_missing(server, tmp_path, damage):
    """A file that is cut or has another hash is refused and deleted."""
    path = server.folder / NAMES[1]
    whole = path.read_bytes()
    path.write_bytes(damage(whole))
    with pytest.raises(DataError, match=rf"{NAMES[1]} could not be downloaded.*hash.*data add"):
        registry.fetch("torino-excerpts", tmp_path / "data")
    assert [p.name for p in (tmp_path / "data").iterdir()] == [NAMES[0]]
    path.write_bytes(whole)
    reported = []
    result = registry.fetch("torino-excerpts", tmp_path / "data", progress=lambda *call: reported.append(call))
    assert [(Path(r.file).name, r.status) for r in result.recordings] == [(name, FileStatus.OK) for name in NAMES]
    assert reported == [("Download", part / 3) for part in range(4)]
    assert server.asked.count(NAMES[0]) == 1  # what was there was kept
