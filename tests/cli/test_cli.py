"""The commands as a user meets them: keys, exit codes, slips of the finger, advice that is right and can be done."""

import json
import os
import re
import shlex
import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import srbval
from srbval.cli.arguments import COMPLETE_FILES, build_parser
from srbval.comparison.comparison import Verdict
from srbval.comparison.verdicts import none_missed
from srbval.errors import ConfigurationError
from srbval.models.simulate import simulate_to_file
from srbval.report import reports
from srbval.report.sections.answer import finding_sentence
from tests.recordings import files

PRINTED_HZ = 96.79, 128.04  # BPFO and BPFI in Table 6 of the paper, at 710 rpm
ROUNDING_HZ = 0.05  # the paper's dimensions are rounded; its frequencies follow from them to this
READING = 3e-4  # relative; a line of a run of one second is read from its envelope spectrum to 0.03 %


def test_kinematics(srbval_json):
    found = srbval_json("kinematics", "--bearing", "skf-22240", "--rpm", "710")
    assert {"shaft_hz", "bpfo_hz", "bpfi_hz", "bsf_hz", "ftf_hz", "orders", "schema_version", "status"} <= set(found)
    assert (found["bpfo_hz"], found["bpfi_hz"]) == pytest.approx(PRINTED_HZ, abs=ROUNDING_HZ)


def test_simulate_then_analyse(srbval_json, tmp_path):
    path = tmp_path / "run.h5"
    made = srbval_json("simulate", "--defect", "inner", "--rpm", "850", "--seconds", "1", "-o", path)
    keys = "model solver dt_s seconds wall_s compile_s wall_per_simulated_s cage_ratio bpfo_hz bpfi_hz file status"
    keys += " drive_power_w roller_load_share energy_imbalance"
    assert set(keys.split()) <= set(made)
    assert (made["status"], made["file"], made["seconds"]) == ("ok", str(path), 1.0)
    read = srbval_json("analyse", path)
    assert {"file", "fs_hz", "seconds", "band_hz", "shaft_hz", "lines", "closure", "verdict", "status"} <= set(read)
    assert (read["band_hz"], read["shaft_hz"]["source"]) == ([500, 1500], "prescribed")
    line = next(n for n in read["lines"] if n["name"] == "BPFI" and n["harmonic"] == 1)
    keys = "name harmonic kinematic_hz found_hz ci95_hz deviation_pct snr false_alarm detected"
    assert set(keys.split()) <= set(line)
    assert line["detected"]
    # the line read from the envelope spectrum against the run's own cage speed
    assert line["found_hz"] == pytest.approx(made["bpfi_hz"], rel=READING)


def test_simulate_follows_the_plan(srbval_json):
    scene = ("--defect", "outer", "--seconds", "2")
    plan = srbval_json("plan", *scene)
    assert {"chosen", "question", "tolerance_pct", "candidates", "schema_version", "status"} <= set(plan)
    assert all({"model", "error_pct", "wall_s", "ok", "why"} <= set(one) for one in plan["candidates"])
    made = srbval_json("simulate", *scene, "--model", "auto")
    assert (made["model"], made["plan"]["candidates"]) == (plan["chosen"], plan["candidates"])


def test_doctor_shows_and_clears_the_cache(srbval_json, tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    kernels = tmp_path / "srbval" / "kernels"
    kernels.mkdir(parents=True)
    (kernels / "one.nbc").write_bytes(bytes(7))
    use = {"kind": "kernels", "folder": str(kernels), "files": 1, "size_bytes": 7}
    found = srbval_json("doctor")
    assert (found["ok"], found["problems"], found["cleared"]) == (True, [], None)
    assert use in found["cache"]
    found = srbval_json("doctor", "--clear-cache", "kernels")
    assert found["cleared"] == [use]
    assert use not in found["cache"]
    assert not kernels.exists()
    assert srbval_json("doctor", "--clear-cache", "kernels", code=2)["status"] == "failed"


@pytest.mark.parametrize(
    ("command", "answer"),
    [
        ("simulate --model impulse --defect outer --seconds 0.2", r"ok: .* BPFO 96\.76 Hz, BPFI 128\.07 Hz\."),
        ("simulate --model planar --seconds 0.1 --rpm 300", r"ok: .* BPFO [\d.]+ Hz, BPFI [\d.]+ Hz\."),
        ("plan rig --defect inner --tolerance 0.5", r"lines within 0\.5 %: \w+ \(.+"),
    ],
)
def test_the_answer_is_the_last_line(command, answer, srbval_text):
    """And shows no object as Python writes it."""
    text = srbval_text(*command.split()).out.splitlines()
    assert re.fullmatch(answer, text[-1])
    assert not [line for line in text if re.search(r"\w\(\w+=|[{<]\w|None|_", line)]
    assert len(text) <= 25


DIGITS = 1e-12  # of the numbers written below
RECORD = ["--bearing", "skf-6205", "--rpm", "1500", "--fs", "8000", "--unit", "g", "--band", "500", "3000"]
SLIPS = {
    "analyze x.mat": "analyse",
    "reprot": "report",
    "data lst": "list",
    "analyse x.mat --rmp 1480": "--rpm",
    "analyse x.mat --bering=skf-6205": "--bearing",
    "data add folder --pulses-per-revolution 2": "--pulses-per-rev",
    "data add folder --state outr": "outer",
    "kinematics --jason": "--json",
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_answered_with_what_was_meant(slip, srbval_text):
    said = srbval_text(*slip.split(), code=2).err
    assert f"Did you mean {SLIPS[slip]}? See: srbval" in said
    assert said.count("\n") == 1


def test_completion(tmp_path):
    """The library shtab completes commands, options and file names from the parser."""
    shtab = pytest.importorskip("shtab")
    script = shtab.complete(build_parser(), shell="bash")
    assert all(word in script for word in ("--pulses-per-rev", "--healthy"))
    assert "_shtab_srbval_analyse_pos_0_COMPGEN=_shtab_compgen_files" in script
    assert COMPLETE_FILES.items() <= shtab.FILE.items()
    (tmp_path / "c").write_text(script)
    asked = 'source c; COMP_WORDS=(srbval ana); COMP_CWORD=1; _shtab_srbval; echo "${COMPREPLY[@]}"'
    found = subprocess.run(["bash", "-c", asked], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert found.stdout.split() == ["analyse"]


@pytest.fixture
def two_channels(tmp_path):
    np.save(tmp_path / "two.npy", np.stack([files.vibration(40_000, seed) for seed in range(2)], axis=1))
    return tmp_path / "two.npy"


@pytest.mark.parametrize("text", ["1/61440", "1/61440 s", "1 / 61.44 ms", "1.627604166667e-5", "16.27604166667us"])
def test_a_step_as_scene_files_have_it(text):
    assert build_parser().parse_args(["simulate", "--dt", text]).dt == pytest.approx(1 / 61440, rel=DIGITS)
    if text[-1] == "s":
        assert srbval.paper_scene(solver={"step": text}).solver.step_s == pytest.approx(1 / 61440, rel=DIGITS)


@pytest.mark.parametrize(
    ("command", "content", "better"),
    [
        ("simulate --model auto", "HDF5", "x.h5"),
        ("identify no.mat", "TOML", "x.toml"),
        ("study run naming", "JSON", "x.json"),
    ],
)
def test_a_file_is_what_its_name_says(command, content, better, tmp_path, srbval_text):
    path = tmp_path / "x.csv"
    said = srbval_text(*command.split(), "-o", path, code=2).err
    assert f"the format is {content}, not .csv; choose the name {better}" in said
    with pytest.raises(ConfigurationError, match="the format is HDF5"):
        simulate_to_file(srbval.paper_scene(), path)
    assert list(tmp_path.iterdir()) == []


def test_everything_missing_is_asked_for_at_once(two_channels, srbval_text):
    questions = ["--channel data[1] | data[2]", "--fs HZ", "--unit", "--bearing", "--rpm R"]

    def unasked(said, *more):
        return [asked for asked in (*questions, *more) if asked not in said]

    said = srbval_text("analyse", two_channels, code=3).err
    assert (unasked(said), "--band" in said) == ([], False)  # a band is chosen
    said = srbval_text("analyse", two_channels, "--rpm", "1500", code=3).err.split("For example")[0]
    assert ("no shaft speed" in said, "--unit" in said) == (False, True)
    said = srbval_text("analyse", two_channels, "--channel", "data[1]", "--fs", "8000", "--unit", "g", code=2).err
    assert [asked for asked in ("no bearing", "no shaft speed") if asked not in said] == []
    (said,) = [line for line in srbval_text("data", "add", two_channels).out.splitlines() if "not stated" in line]
    assert unasked(said, "--tacho") == []
    assert "name a folder or a file" in srbval_text("data", "add", code=2).err
    for command in (["report", "-o", two_channels.parent / "report"], ["identify"]):
        said = srbval_text(*command, two_channels, code=3).err
        assert (unasked(said), "srbval analyse" in said) == ([], False)


@pytest.mark.parametrize(
    ("bearing", "stated"),
    [
        (["--elements", "9,7.94,39.04,0"], ["--band", "500", "3000"]),
        (["--orders", "3.58,5.42,2.36,0.398"], ["--auto-band"]),
    ],
)
def test_what_a_machines_file_states_is_registered_once(
    stated, bearing, two_channels, monkeypatch, srbval_json, srbval_text
):
    """Band, dimensions and orders, by a machine's file or by options; what an option says goes over it."""
    home = two_channels.parent / "home"
    monkeypatch.setenv("SRBVAL_HOME", str(home))
    options = ["--channel", "data[1]", *RECORD[2:8], *bearing, *stated]
    machine = two_channels.parent / "machine.toml"
    wanted = srbval_json("analyse", two_channels, *options, "--write-machine", machine)
    for given in (["--machine", machine], options):
        srbval_text("data", "add", "--repin", two_channels, *given)
        found = srbval_json("analyse", two_channels)
        for key in ("band_hz", "lines", "bearing"):
            assert found[key] == wanted[key]
    assert srbval_json("analyse", two_channels, "--band", "600", "2900")["band_hz"] == [600, 2900]
    assert "band 3000 to 500 Hz" in srbval_text("data", "add", two_channels, "--band", "3000", "500", code=2).err
    older = json.loads((home / "manifest.json").read_text(encoding="utf-8"))
    for key in ("band_hz", "auto_band"):
        del older["recordings"][0]["settings"][key]
    (home / "manifest.json").write_text(json.dumps(older), encoding="utf-8")
    srbval_text("data", "list")


def test_a_ball_is_a_rolling_element(two_channels, srbval_json):
    """The field's word for it in a ball bearing."""
    given = [two_channels, "--channel", "data[1]", *RECORD]
    found = [srbval_json("analyse", *given, "--defect", part)["lines"] for part in ("ball", "roller")]
    assert found[0] == found[1]
    assert {line["name"][:5] for line in found[0]} == {"2xBSF"}
    assert srbval_json("data", "add", two_channels, "--state", "ball")["recordings"][0]["state"] == "roller"


@pytest.mark.parametrize(("verdict", "code"), [(Verdict.MET, 0), (Verdict.NOT_RESOLVED, 0), (Verdict.MISSED, 1)])
def test_only_a_tolerance_that_is_missed_ends_with_1(verdict, code, tmp_path, monkeypatch, srbval_json):
    rows = [{"endpoint": "e", "scene": "rig", "verdict": verdict.value}]
    headline, kicker = {"holds": none_missed(rows), "verdicts": rows}, finding_sentence(rows)
    report = SimpleNamespace(data={"table6": (), "headline": headline}, verdict=SimpleNamespace(kicker=kicker))
    monkeypatch.setattr(reports, "make_report", lambda *_, **__: (report, {}))
    said = srbval_json("report", "-o", tmp_path / "out", code=code)["headline"]
    assert said == {"holds": code == 0, "verdicts": rows, "text": kicker}
    assert ("A finding about the model, not a failure of the program" in kicker) is (code == 1)


def test_a_model_of_ones_own_that_fails_ends_a_comparison_with_4(tmp_path, srbval_json):
    (tmp_path / "model.py").write_text("def fails(scene):\n    raise RuntimeError('no luck')\n")
    command = ["validate", "--measured", "OR_877rpm_sample.h5", "--model", f"{tmp_path / 'model.py'}:fails", "--no-pdf"]
    found = srbval_json(*command, "-o", tmp_path / "out", code=4)
    assert (found["status"], len(found["pairs"])) == ("run failed", 1)
    assert "no luck" in found["pairs"][0]["problem"]


REPORTED = shlex.split("--bearing b.toml --rpm 1500 --fs 10000 --unit g --band 1000 3000 --no-pdf")


@pytest.fixture
def _in_a_folder_with_a_bearing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    orders = "rolling_elements = 9\nbpfo = 3.585\nbpfi = 5.415\nbsf = 2.357\nftf = 0.398\n"
    Path("b.toml").write_text(f'title = "b"\nsource = "s"\n[orders]\n{orders}')


@pytest.mark.usefixtures("_in_a_folder_with_a_bearing")
def test_one_bad_file_does_not_end_a_batch(srbval_json, srbval_text):
    """The others get their report, in a folder of their name, which says what is not in it and why."""
    for seed, name in enumerate(("one.csv", "two.csv", "short.csv")):
        np.savetxt(name, np.random.default_rng(seed).normal(size=30_000 if len(name) < 8 else 30), fmt="%.5f")
    Path("text.csv").write_text("no number\n")
    found = srbval_json("report", "text.csv", "one.csv", "short.csv", "two.csv", *REPORTED, code=3)
    assert (found["status"], [Path(r["file"]).name for r in found["records"]]) == ("incomplete", ["one.csv", "two.csv"])
    assert sorted(Path(f["file"]).name for f in found["failed"]) == ["short.csv", "text.csv"]
    page = Path("srbval-report-text-and-3-more/report.html").read_text(encoding="utf-8")
    assert all(one["file"] in page for one in found["failed"])
    srbval_text("report", "one.csv", *REPORTED)
    assert Path("srbval-report-one/report.json").is_file()
    before = set(os.listdir())
    said = srbval_text("report", "text.csv", "short.csv", *REPORTED, code=3).err
    assert "none of the recordings can be analysed: text.csv: " in said
    for one in found["failed"]:
        assert f"{one['file']}: {one['reason']}" in said
    assert set(os.listdir()) == before


@pytest.mark.usefixtures("_in_a_folder_with_a_bearing")
def test_a_folder_has_a_row_for_each_record_and_sections_for_the_most_serious(srbval_json):
    Path("fan").mkdir()
    for seed in range(8):
        samples = np.random.default_rng(seed).normal(size=30_000)
        since = np.mod(np.arange(samples.size) / 10_000, 1 / (3.585 * 25))
        np.save(f"fan/{seed}.npy", samples + 20 * (seed in (2, 5)) * np.exp(-900 * since) * np.sin(12_566 * since))
    Path("fan/bad.npy").write_bytes(b"")
    found = srbval_json("report", "fan", *REPORTED, code=3)
    alarms = [one["fault"]["verdict"] != "nothing found" for one in found["records"]]
    assert (len(alarms), [Path(one["file"]).name for one in found["failed"]]) == (8, ["bad.npy"])
    assert alarms == sorted(alarms, reverse=True)
    assert {Path(one["file"]).stem for one in found["records"][:2]} == {"2", "5"}
    page = Path("srbval-report-fan/report.html").read_text(encoding="utf-8")
    assert page.count('id="spectrum-figure-') == min(6, sum(alarms)) < 8
    assert "The first" in page
