"""`srbval analyse` for people: the answer first, of one file, and of a folder with broken files in it."""

import re
import shlex
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from srbval.monitoring import batch
from tests.reading.test_shaft_speed import FS_HZ, record

GIVEN = ["--fs", f"{FS_HZ:g}", "--rpm", "1500", "--unit", "g", "--bearing", "skf-6205", "--band", "2000", "5000"]
FILES, FAULTY, BROKEN = 6, 2, 3  # of a folder of 9
READ_FIRST = 6  # of them, before Ctrl-C


@pytest.fixture
def folder(tmp_path):
    """Healthy noise of one machine, inner-race faults, three broken files, and what is no recording."""
    made = tmp_path / "machine"
    made.mkdir()
    for number in range(FILES):
        samples = record(shaft_hz=25.0, seed=number, fault=number < FAULTY).channels["x"]
        np.save(made / f"run{number:02}.npy", samples.astype(np.float32))
    (made / "empty.npy").write_bytes(b"")
    (made / "cut.npy").write_bytes((made / "run00.npy").read_bytes()[:1000])
    (made / "zeros.npy").write_bytes(bytes(4000))
    (made / "LICENSE.txt").write_text("Free to use.\n")
    return made


@pytest.fixture
def faulty_file(tmp_path):
    np.save(tmp_path / "faulty.npy", record(shaft_hz=25.0).channels["x"].astype(np.float32))
    return tmp_path / "faulty.npy"


def test_the_answer_comes_first(faulty_file, tmp_path, srbval_json, srbval_text):
    """What, where, how sure and against what in the first line; the numbers are those of the JSON, to their digits."""
    document = srbval_json("analyse", faulty_file, *GIVEN, "--export", tmp_path / "lines.csv")
    first, *text = srbval_text("analyse", faulty_file, *GIVEN).out.splitlines()
    assert len(text) < 15  # lines, at most, of an answer for people
    assert re.fullmatch(r"Inner race fault: .* \(inner race \d+ %, against records .*\)\.", first)
    line = next(one for one in document["lines"] if (one["name"], one["harmonic"]) == ("BPFI", 1))
    (row,) = [one for one in text if one.startswith("BPFI ")]
    value, half = map(float, re.search(r"([\d.]+) ± ([\d.]+)", row).groups())
    assert (value, half) == (pytest.approx(line["found_hz"], abs=half / 10), pytest.approx(line["ci95_hz"], rel=0.06))
    missed = next(one for one in text if one.startswith("not found: "))
    assert {one["name"] for one in document["families"] if not one["detected"]} <= set(re.split(r"[ ,]", missed))
    assert len((tmp_path / "lines.csv").read_text().splitlines()) == 1 + len(document["lines"])


def test_everything_fits_a_terminal_and_goes_to_files(faulty_file, tmp_path, srbval_json, srbval_text):
    """Lines and features, alike in the printed table, JSON, CSV and Excel; accelerations in m/s2 and g."""
    command = ["analyse", faulty_file, *GIVEN]
    _, _, *text = srbval_text(*command, "--all", "--export", tmp_path / "out.xlsx").out.splitlines()
    assert [line for line in text if len(line) >= 100] == []
    document = srbval_json(*command, "--export", tmp_path / "out.csv")
    book = pd.read_excel(tmp_path / "out.xlsx", sheet_name=None)
    for name, key, file in (("lines", "lines", "out.csv"), ("features", "feature_table", "out-features.csv")):
        pd.testing.assert_frame_equal(book[name], pd.read_csv(tmp_path / file), check_dtype=False)
        assert len(book[name]) == len(document[key])
    values = {(row["feature"], row["unit"]): row["value"] for row in document["feature_table"]}
    assert values["RMS", "m/s2"] == document["features"]["rms"] == pytest.approx(9.80665 * values["RMS", "g"])
    assert any(re.match(rf"kurtosis +{values['kurtosis', '']:.4g}", line) for line in text)


def test_what_a_file_leaves_open_comes_with_a_command_that_works(tmp_path, srbval_text):
    """For a name with a space and several channels too: the example runs as it is printed."""
    file = tmp_path / "two channels.npz"
    channels = record(shaft_hz=25.0, seed=1, fault=True).channels["x"]
    np.savez(file, **{"drive end": channels, "fan end": channels})
    said = srbval_text("analyse", file, code=3).err.splitlines()
    (example,) = [line.removeprefix("For example: ") for line in said if line.startswith("For example: ")]
    words = shlex.split(example)
    assert {"--channel", "--fs", "--unit", "--bearing", "--rpm"} < set(words)
    words[words.index("machine.toml")] = str(tmp_path / "machine.toml")
    srbval_text(*words[1:])
    srbval_text("analyse", file, "--machine", tmp_path / "machine.toml")


IN_PROCESSES = batch.in_processes  # the real one, which `conftest.py` replaces


def interrupted(function, waiting, *, jobs):
    for done, answer in enumerate(IN_PROCESSES(function, waiting, jobs=jobs)):
        yield answer
        if done == READ_FIRST - 1:
            raise KeyboardInterrupt


def test_a_folder_with_broken_files_goes_on_where_it_stopped(folder, srbval_json, srbval_text, monkeypatch):
    """All that can be read is in the table, the faults first; what was read before Ctrl-C is not read again."""
    monkeypatch.setattr(batch, "in_processes", interrupted)
    command, left = ["analyse", folder, *GIVEN], []
    srbval_text(*command, code=130)

    def counted(function, waiting, **_):
        left.append(len(waiting))
        return ((one, function(one)) for one in waiting)

    monkeypatch.setattr(batch, "in_processes", counted)
    document = srbval_json(*command, code=3)
    assert left[0] <= FILES + BROKEN + 1 - (READ_FIRST - BROKEN - 1)  # at most four of those read failed
    assert len(document["records"]) == FILES
    failed = {Path(one["file"]).name: one["reason"] for one in document["failed"]}
    assert set(failed) == {"empty.npy", "cut.npy", "zeros.npy"}
    assert "0 bytes" in failed["empty.npy"]
    assert [Path(name).name for name in document["left_out"]] == ["LICENSE.txt"]
    named = [Path(one["file"]).name for one in document["records"] if one["fault"]["called"] == "inner"]
    assert sorted(named) == [f"run{number:02}.npy" for number in range(FAULTY)]
    assert [Path(one["file"]).name for one in document["records"][:FAULTY]] == named
    alone = srbval_json("analyse", document["records"][0]["file"], *GIVEN)
    assert {key: alone[key] for key in document["records"][0]} == document["records"][0]
    shown = srbval_text(*command, code=3)
    assert left[1] == BROKEN + 1  # what could not be read is tried again
    first, _, header, *rows = shown.out.splitlines()
    assert first.startswith(f"{FILES} records: {FAULTY} inner race fault, ")
    assert first.endswith(f"{BROKEN} files could not be read.")
    assert header.split()[0] == "file"
    assert [title for title in ("line", "Hz", "times noise") if title not in header] == []
    serious = [(-round(100 * (row["probability"] or 0)), -(row["snr"] or 0)) for row in document["summary"][:FAULTY]]
    assert serious == sorted(serious)
    assert all((row["line"], row["found_hz"] > 0) == ("BPFI", True) for row in document["summary"][:FAULTY])
    assert {row["strongest_fault"] for row in document["summary"] if row["state"] == "nothing found"} <= {None}
    assert all(len(row) <= 80 for row in rows[: len(document["records"])])
    assert all(row.endswith("yes") for row in rows[:FAULTY])
    assert all(f"not read: {folder / name}: " in shown.err for name in failed)


@pytest.mark.recordings
@pytest.mark.parametrize(
    ("files", "options", "called", "alone"),
    [("torino/IR_*", [], "inner", 2), ("ims_test1/2003*", ["--channel", "ch7"], None, 0)],
)
def test_records_of_one_machine_are_judged_together(
    recordings_dir, srbval_json, srbval_text, files, options, called, alone
):
    """The rig's inner race at two speeds, of which one shows little; and a bearing of which no fault line shows."""
    command = ["analyse", *recordings_dir.glob(files), *options, "--one-machine"]
    document = srbval_json(*command)
    machine = document["machine"]
    assert (machine["called"], machine["records"]) == (called, len(document["records"]))
    assert sum(one["fault"]["state"] == "inner" for one in document["records"]) == alone
    assert srbval_text(*command).out.startswith(machine["sentence"])


def test_one_machine_has_one_bearing(tmp_path, srbval_text):
    kept = [tmp_path / f"run{number}.npy" for number in range(2)]
    for seed, (file, bearing) in enumerate(zip(kept, ("skf-6205", "skf-6203"), strict=True)):
        np.save(file, record(shaft_hz=25.0, seed=seed).channels["x"].astype(np.float32))
        srbval_text("data", "add", file, "--bearing", bearing, "--fs", f"{FS_HZ:g}", "--rpm", "1500")
    given = ["--unit", "g", "--band", "2000", "5000", "--one-machine"]
    assert "of 2 bearings, skf-6203 and skf-6205" in srbval_text("analyse", *kept, *given, code=2).err
    said = srbval_text("analyse", *kept, *given, "--bearing", "skf-6205").out
    assert said.startswith("One machine: inner race fault (inner race ")
