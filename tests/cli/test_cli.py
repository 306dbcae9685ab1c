"""The commands as a user meets them: keys, exit codes, messages, no trace left behind."""

import re

import pytest

from srbval.recordings import load_recording

BPFO_HZ, BPFI_HZ = 96.79, 128.04  # printed in Table 6 of the paper, at 710 rpm
PRINTED_HZ = 0.05  # the paper's dimensions are rounded; its frequencies follow from them to this
ROUNDING_HZ = 1e-9  # of sums of floating-point numbers near 200 Hz
READING = 2e-4  # relative; a line of a run of two seconds is read from its envelope spectrum to 0.02 %


def test_kinematics(srbval_json):
    found = srbval_json("kinematics", "--bearing", "skf-22240", "--rpm", "710")
    assert {"shaft_hz", "bpfo_hz", "bpfi_hz", "bsf_hz", "ftf_hz", "orders", "schema_version", "status"} <= set(found)
    assert found["bpfo_hz"] == pytest.approx(BPFO_HZ, abs=PRINTED_HZ)
    assert found["bpfi_hz"] == pytest.approx(BPFI_HZ, abs=PRINTED_HZ)
    assert found["bpfo_hz"] + found["bpfi_hz"] == pytest.approx(19 * found["shaft_hz"], abs=ROUNDING_HZ)


def test_simulate_then_analyse(srbval_json, tmp_path):
    path = tmp_path / "run.h5"
    made = srbval_json("simulate", "--defect", "inner", "--rpm", "850", "--seconds", "2", "-o", path)
    keys = "model solver dt_s seconds wall_s compile_s wall_per_simulated_s cage_ratio bpfo_hz bpfi_hz file status"
    assert set(keys.split()) <= set(made)
    assert (made["status"], made["file"], made["seconds"]) == ("ok", str(path), 2.0)
    read = srbval_json("analyse", path)
    assert {"file", "fs_hz", "seconds", "band_hz", "shaft_hz", "lines", "closure", "verdict", "status"} <= set(read)
    assert (read["band_hz"], read["shaft_hz"]["source"]) == ([500, 1500], "prescribed")
    line = next(n for n in read["lines"] if n["name"] == "BPFI" and n["harmonic"] == 1)
    keys = "name harmonic kinematic_hz found_hz ci95_hz deviation_pct snr false_alarm detected"
    assert set(keys.split()) <= set(line)
    assert line["detected"]
    # the line read from the envelope spectrum against the run's own cage speed
    assert line["found_hz"] == pytest.approx(made["bpfi_hz"], rel=READING)


def test_what_a_bearing_does_is_no_failure(srbval_json, tmp_path):
    """Its file is written, read again, and says so."""
    given, path = tmp_path / "scene.toml", tmp_path / "run.h5"
    given.write_text('duration = "0.1 s"\n[contact]\nradial_play = "0.2 mm"\n')
    made = srbval_json("simulate", given, "-o", path)
    assert made["status"] == "rollers-unloaded"
    assert {"drive_power_w", "roller_load_share", "energy_imbalance"} <= set(made)
    assert isinstance(made["drive_power_w"], float)
    assert any("the run ended rollers-unloaded" in note for note in load_recording(path).notes)


def test_plan(srbval_json):
    found = srbval_json("plan", "--defect", "outer", "--tolerance", "0.5")
    assert {"chosen", "question", "tolerance_pct", "candidates", "schema_version", "status"} <= set(found)
    assert (found["question"], found["tolerance_pct"]) == ("lines", 0.5)
    for candidate in found["candidates"]:
        assert {"model", "error_pct", "wall_s", "ok", "why"} <= set(candidate)


def test_simulate_follows_the_plan(srbval_json):
    scene = ("--defect", "outer", "--seconds", "2")
    plan = srbval_json("plan", *scene)
    made = srbval_json("simulate", *scene, "--model", "auto")
    assert (made["model"], made["plan"]["candidates"]) == (plan["chosen"], plan["candidates"])


def test_doctor_shows_and_clears_the_cache(srbval_json, tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    kernels = tmp_path / "kernels"
    kernels.mkdir()
    (kernels / "one.nbc").write_bytes(bytes(7))
    use = {"kind": "kernels", "folder": str(kernels), "files": 1, "size_bytes": 7, "left": 0}
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
