"""A bearing from a TOML file: every model its tables allow, and what is then not validated is said."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import srbval
from srbval.cli import main

GUIDE = Path(srbval.__file__).parent / "docs" / "guide" / "your_bearing.md"
SECONDS = "1 s"
LINE = 2e-3  # of a line, within a fifth of a resolution of 1 Hz at 100 Hz
CAGE = 0.02  # of the cage speed of pure rolling: slip of a well loaded bearing
ROUNDING = 1e-9


def guide_tables() -> dict[str, str]:
    """The bearing files of the user guide, by the table that they have."""
    texts = re.findall(r"```toml\n(.*?)```", GUIDE.read_text(encoding="utf-8"), flags=re.DOTALL)
    return {re.findall(r"^\[(\w+)\]", text, flags=re.MULTILINE)[0]: text for text in texts}


@pytest.fixture
def file(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """A bearing file of the guide."""
    path = tmp_path / "mine.toml"
    path.write_text(guide_tables()[request.param], encoding="utf-8")
    return path


@pytest.mark.parametrize("file", ["orders", "elements", "geometry"], indirect=True)
@pytest.mark.parametrize("model", ["kinematic", "impulse"])
@pytest.mark.parametrize(("kind", "name"), [("inner", "BPFI")])
def test_the_simpler_models_put_the_line_where_kinematics_does(file: Path, model: str, kind: str, name: str) -> None:
    scene = srbval.paper_scene(bearing=str(file), model=model, duration=SECONDS, defect={"kind": kind})
    run = srbval.simulate(scene)
    bearing = srbval.load_bearing(file)
    assert run.status is srbval.RunStatus.OK, run.reason
    line = srbval.analyse(srbval.recording_from_run(run), bearing=bearing).line(name)
    assert line.detected
    assert line.found_hz == pytest.approx(getattr(bearing.orders, name.lower()) * scene.shaft_hz, rel=LINE)


@pytest.mark.parametrize("file", ["geometry"], indirect=True)
def test_the_full_model_runs_where_there_is_one(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(
        f'bearing = "{file.as_posix()}"\nshaft_speed = "1480 rpm"\nduration = "0.2 s"\n[load]\nradial = "40 kN"\n'
        '[contact]\nroller_fit = "play"\n',
        encoding="utf-8",
    )
    output = tmp_path / "run.h5"
    assert main(["simulate", str(scene), "--json", "-o", str(output)]) == 0
    document = json.loads(capsys.readouterr().out)
    orders = srbval.load_bearing(file).orders
    assert document["cage_ratio"] == pytest.approx(orders.ftf, rel=CAGE)
    assert any("held against the skf-22240 alone" in what for what in document["not_validated"])
    recording = srbval.load_recording(output)
    assert any("not validated" in note and "skf-22240 alone" in note for note in recording.notes)


def test_pulses_without_dimensions_follow_the_load() -> None:
    scene = srbval.paper_scene(model="impulse", bearing="fag-22205", duration="0.5 s", defect={"kind": "outer"})
    half = srbval.paper_scene(
        model="impulse", bearing="fag-22205", duration="0.5 s", defect={"kind": "outer"}, load={"radial": "62.4 kN"}
    )
    whole_rms, half_rms = (np.sqrt(np.mean(srbval.simulate(s).acceleration_m_s2 ** 2)) for s in (scene, half))
    assert half_rms == pytest.approx(whole_rms / 2, rel=ROUNDING)
