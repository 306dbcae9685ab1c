"""The package's public names, loaded only when used; pictures, tables and short representations for notebooks."""

import ast
import functools
import subprocess
import sys
from pathlib import Path

import pytest

import srbval
from tests.reading.test_shaft_speed import BEARING, record


@pytest.mark.parametrize("name", srbval.__all__)
def test_every_name_is_there(name):
    assert getattr(srbval, name) is not None


def test_what_is_loaded_is_what_type_checkers_see():
    stub = ast.parse(Path(srbval.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    (seen,) = (ast.literal_eval(node.value) for node in stub.body if isinstance(node, ast.Assign))
    assert sorted(srbval.__all__) == sorted(seen)


def test_importing_the_package_imports_nothing_else():
    code = "import sys, srbval; sys.exit(len([m for m in sys.modules if m.split('.')[0] in {'numpy','numba','scipy'}]))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@functools.cache
def run() -> srbval.Run:
    return srbval.simulate(srbval.paper_scene(model="impulse", duration="0.5 s", defect={"kind": "outer"}))


@functools.cache
def analysis() -> srbval.Analysis:
    return srbval.analyse(record(shaft_hz=25.0), bearing=BEARING)


def test_a_run_is_a_table_a_picture_and_a_line_of_text():
    frame = run().to_frame()
    assert len(frame) == run().samples
    assert frame["acceleration_x_m_s2"].to_numpy() == pytest.approx(run().acceleration_m_s2[:, 0])
    assert len(srbval.plot(run()).axes) == 3
    assert srbval.plot(run())._repr_png_().startswith(b"\x89PNG")  # shown in a notebook that never imported pyplot
    assert repr(run()).startswith("<Run ok: impulse model, skf-22240, outer race, 710 rpm, 0.5 s")


def test_an_analysis_is_a_table_a_picture_and_a_line_of_text():
    frame = analysis().to_frame()
    inner = frame[(frame["name"] == "BPFI") & (frame["harmonic"] == 1)].iloc[0]
    assert inner["found_hz"] == analysis().line("BPFI").found_hz
    labels = [text.get_text() for axes in srbval.plot(analysis()).axes for text in axes.texts]
    assert any(text.startswith("BPFI  135.4 Hz") for text in labels)
    assert repr(analysis()).endswith("BPFI detected>")
    assert repr(analysis().recording) == "<Recording made for the test: measured, inner race, x, 3 s at 12000 Hz>"
