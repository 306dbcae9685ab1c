"""`srbval analyse` for people: the answer first, of one file, and of a folder with broken files in it."""

import json
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import srbval.diagnosis.records as records
from srbval.cli import main
from tests.cli.test_properties import SHORT
from tests.reading.test_shaft_speed import FS_HZ, record

GIVEN = ["--fs", f"{FS_HZ:g}", "--rpm", "1500", "--unit", "g", "--bearing", "skf-6205", "--band", "2000", "5000"]
FILES, FAULTY, BROKEN = 47, 3, 3  # of a folder of 50


@pytest.fixture
def folder(tmp_path: Path) -> Path:
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


def test_the_answer_comes_first(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What, where, how sure and against what in the first line; the numbers are those of the JSON, to their digits."""
    file = str(folder / "run00.npy")
    assert main(["analyse", file, *GIVEN, "--json", "--csv", str(folder / "lines.csv")]) == 0
    document = json.loads(capsys.readouterr().out)
    assert main(["analyse", file, *GIVEN]) == 0
    first, *text = capsys.readouterr().out.splitlines()
    assert len(text) < SHORT
    assert re.fullmatch(r"Inner race fault: .* \(inner race \d+ % by the record alone, against records .*\)\.", first)
    line = next(one for one in document["lines"] if (one["name"], one["harmonic"]) == ("BPFI", 1))
    (row,) = [one for one in text if one.startswith("BPFI ")]
    value, half = map(float, re.search(r"([\d.]+) ± ([\d.]+)", row).groups())  # type: ignore[union-attr]
    assert (value, half) == (pytest.approx(line["found_hz"], abs=half / 10), pytest.approx(line["ci95_hz"], rel=0.06))
    missed = next(one for one in text if one.startswith("not found: "))
    assert {one["name"] for one in document["families"] if not one["detected"]} <= set(re.split(r"[ ,]", missed))
    table = (folder / "lines.csv").read_text().splitlines()
    assert len(table) == 1 + len(document["lines"])


def test_everything_fits_a_terminal_and_goes_to_files(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Lines and features, alike in the printed table, JSON, CSV and Excel; accelerations in m/s2 and g."""
    command = ["analyse", str(folder / "run00.npy"), *GIVEN]
    assert main([*command, "--all", "--export", str(folder / "out.xlsx")]) == 0
    _, _, *text = capsys.readouterr().out.splitlines()
    assert [line for line in text if len(line) >= 100] == []
    assert main([*command, "--json", "--export", str(folder / "out.csv")]) == 0
    document = json.loads(capsys.readouterr().out)
    book = pd.read_excel(folder / "out.xlsx", sheet_name=None)
    for name, key, file in (("lines", "lines", "out.csv"), ("features", "feature_table", "out-features.csv")):
        pd.testing.assert_frame_equal(book[name], pd.read_csv(folder / file), check_dtype=False)
        assert len(book[name]) == len(document[key])
    values = {(row["feature"], row["unit"]): row["value"] for row in document["feature_table"]}
    assert values["RMS", "m/s2"] == document["features"]["rms"] == pytest.approx(9.80665 * values["RMS", "g"])
    assert any(re.match(rf"kurtosis +{values['kurtosis', '']:.4g}", line) for line in text)


def test_what_a_file_leaves_open_comes_with_a_command_that_works(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """For a name with a space and several channels too: the example runs as it is printed."""
    file = tmp_path / "two channels.npz"
    channels = record(shaft_hz=25.0, seed=1, fault=True).channels["x"]
    np.savez(file, **{"drive end": channels, "fan end": channels})
    assert main(["analyse", str(file)]) == 3
    said = capsys.readouterr().err.splitlines()
    (example,) = [line.removeprefix("For example: ") for line in said if line.startswith("For example: ")]
    words = shlex.split(example)
    assert {"--channel", "--fs", "--unit", "--bearing", "--rpm"} < set(words)
    words[words.index("machine.toml")] = str(tmp_path / "machine.toml")
    assert main(words[1:]) == 0
    assert main(["analyse", str(file), "--machine", str(tmp_path / "machine.toml")]) == 0


IN_PROCESSES = records.in_processes


def interrupted(function: Any, waiting: Any, *, jobs: int | None) -> Iterator[Any]:
    for done, answer in enumerate(IN_PROCESSES(function, waiting, jobs=jobs)):
        yield answer
        if done == 9:
            raise KeyboardInterrupt


def test_a_folder_with_broken_files_goes_on_where_it_stopped(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """All that can be read is in the table, the faults first; what was read before Ctrl-C is not read again."""
    monkeypatch.setattr(records, "in_processes", interrupted)
    command = ["analyse", str(folder), *GIVEN]
    assert main(command) == 130
    left = list[int]()

    def counted(function: Any, waiting: Any, *, jobs: int | None) -> Any:
        left.append(len(waiting))
        return IN_PROCESSES(function, waiting, jobs=jobs)

    monkeypatch.setattr(records, "in_processes", counted)
    capsys.readouterr()
    assert main([*command, "--json"]) == 3
    printed = capsys.readouterr()
    document = json.loads(printed.out)
    assert left[0] <= FILES + BROKEN + 1 - 7  # ten were read, of them three broken at most
    assert len(document["records"]) == FILES
    failed = {Path(one["file"]).name: one["reason"] for one in document["failed"]}
    assert set(failed) == {"empty.npy", "cut.npy", "zeros.npy"}
    assert "0 bytes" in failed["empty.npy"]
    assert [Path(name).name for name in document["left_out"]] == ["LICENSE.txt"]
    named = [Path(one["file"]).name for one in document["records"] if one["fault"]["called"] == "inner"]
    assert sorted(named) == [f"run{number:02}.npy" for number in range(FAULTY)]
    assert [Path(one["file"]).name for one in document["records"][:FAULTY]] == named
    assert main(["analyse", document["records"][0]["file"], *GIVEN, "--json"]) == 0
    alone = json.loads(capsys.readouterr().out)
    assert {key: alone[key] for key in document["records"][0]} == document["records"][0]
    assert main(command) == 3
    shown = capsys.readouterr()
    assert left[1] == BROKEN + 1  # what could not be read is tried again
    first, _, header, *rows = shown.out.splitlines()
    assert first.startswith(f"{FILES} records: {FAULTY} inner race fault, ")
    assert first.endswith(f"{BROKEN} files could not be read.")
    assert header.split()[0] == "file"
    assert all(len(row) <= 80 for row in rows[: len(document["records"])])
    assert all(row.endswith("yes") for row in rows[:FAULTY])
    assert all(f"not read: {folder / name}: " in shown.err for name in failed)


@pytest.mark.recordings
@pytest.mark.parametrize(
    ("files", "options", "called", "alone", "cage"),
    [("torino/IR_*", [], "inner", 1, 0), ("ims_test1/2003*", ["--channel", "ch7"], None, 0, 3)],
)  # fmt: skip
def test_records_of_one_machine_are_judged_together(
    recordings_dir: Path, capsys: pytest.CaptureFixture[str], files: str, options: list[str], called: str | None,
    alone: int, cage: int,
) -> None:  # fmt: skip
    """The rig's inner race at two speeds, of which one shows little; and a bearing of which the cage alone shows."""
    names = [*map(str, recordings_dir.glob(files))]
    assert main(["analyse", *names, *options, "--one-machine", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    machine = document["machine"]
    assert (machine["called"], machine["records"]) == (called, len(names))
    assert sum(one["fault"]["state"] == "inner" for one in document["records"]) == alone
    assert f"stands out in {cage} records" in machine["sentence"] if cage else "cage" not in machine["sentence"]
    assert main(["analyse", *names, *options, "--one-machine"]) == 0
    assert capsys.readouterr().out.startswith(machine["sentence"])


def test_one_machine_has_one_bearing(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    kept = [str(folder / f"run{number:02}.npy") for number in range(2)]
    for file, bearing in zip(kept, ("skf-6205", "skf-6203"), strict=True):
        assert main(["data", "add", file, "--bearing", bearing, "--fs", f"{FS_HZ:g}", "--rpm", "1500"]) == 0
    given = ["--unit", "g", "--band", "2000", "5000", "--one-machine"]
    assert main(["analyse", *kept, *given]) == 2
    assert "of 2 bearings, skf-6203 and skf-6205" in capsys.readouterr().err
    assert main(["analyse", *kept, *given, "--bearing", "skf-6205"]) == 0
    assert capsys.readouterr().out.startswith("One machine: inner race fault (inner race ")
