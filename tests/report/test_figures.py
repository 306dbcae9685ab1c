"""Panels: pictures exist, name synthetic data, are the same each time, and have their data beside them."""

import csv
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.report.figures import style
from srbval.report.figures.signals import draw_acceleration, draw_band, draw_scalogram, draw_spectrum
from srbval.report.figures.style import Panel, figure_style
from srbval.report.sections.table6 import draw_cage_ratios
from srbval.signal import Scalogram

from .conftest import spectrum, view

LARGEST_BYTES = 150_000  # some twenty panels and more must fit into a page of 6 MB
SCALOGRAM_HZ = np.geomspace(20, 4000, 200)
SCALOGRAM_COLUMNS = [f"magnitude_at_{f:.4g}_hz" for f in SCALOGRAM_HZ[np.linspace(0, 199, 40).round().astype(int)]]
AXES = {"time_s": np.linspace(0, 0.2, 2048), "frequency_hz": SCALOGRAM_HZ, "edge_s": np.full(200, 0.01)}
IMAGE = Scalogram(**AXES, amplitude=np.random.default_rng(3).random((200, 2048)))
DRAWERS = {
    "acceleration": lambda of, title: Panel(draw_acceleration, of, limit=6.0, title=title, period=("1/BPFO", 0.01)),
    "spectrum": lambda of, title: Panel(draw_spectrum, spectrum(of), top=33.6, title=title),
    "brief": lambda of, title: Panel(draw_spectrum, spectrum(of), top=33.6, title=title, brief=True),
    "scalogram": lambda of, title: Panel(draw_scalogram, of, Fault.INNER, top=1.0, title=title),
    "band": lambda of, _: Panel(draw_band, {"outer": of}),
}
COLUMNS = {
    "acceleration": ["time_s", "acceleration_std", "envelope_std"],
    "spectrum": ["frequency_hz", "shaft_order", "amplitude", "healthy_amplitude"],
    "brief": ["frequency_hz", "shaft_order", "amplitude", "healthy_amplitude"],
    "scalogram": ["time_s", *SCALOGRAM_COLUMNS],
    "band": ["frequency_hz", "outer_db"],
}


def draw(kind, folder, origin="measured", title=""):
    DRAWERS[kind](view(origin, scalogram=IMAGE), title)(folder, "a")
    return SimpleNamespace(picture=folder / "a.svg", data=folder / "a.csv")


def rows_of(files):
    with files.data.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("kind", DRAWERS)
def test_pictures_are_small_dateless_the_same_each_time_and_only_a_stand_in_is_called_one(kind, tmp_path):
    """The plotted data lies beside each."""
    first, second = draw(kind, tmp_path / "1"), draw(kind, tmp_path / "2", title=r"$\frac{1 <b> & " + "x" * 300)
    assert draw(kind, tmp_path / "3").picture.read_bytes() == first.picture.read_bytes()
    assert second.data.read_bytes() == first.data.read_bytes()
    text = first.picture.read_text("utf-8")
    assert 5_000 < len(text) < LARGEST_BYTES
    assert "<dc:date>" not in text
    assert "Measured" in text
    assert "Synthetic stand-in" not in text
    assert "Synthetic stand-in" in draw(kind, tmp_path / "4", "stand-in").picture.read_text("utf-8")
    rows = rows_of(first)
    assert list(rows[0]) == COLUMNS[kind]
    assert len(rows) * (len(rows[0]) - 1) > 400
    assert all(np.isfinite(float(value)) for row in rows for value in row.values())


def test_a_panel_is_drawn_again_only_if_its_data_or_its_code_has_changed(tmp_path, monkeypatch):
    record, drawn, draw_now = view("measured"), [], style._files_of
    monkeypatch.setattr(style, "_files_of", lambda *of: drawn.append(of) or draw_now(*of))
    lines = tmp_path / "lines.mplstyle"
    lines.write_text(style.STYLE_FILE.read_text().replace("lines.linewidth: 1.0", "lines.linewidth: 2.0"))

    def draws_once_more(name, *patch, record=record, title="one"):
        before = len(drawn)
        with monkeypatch.context() as context:
            context.setattr(*patch or (style, "__doc__", ""))
            DRAWERS["acceleration"](record, title)(tmp_path, name)
        return len(drawn) == before + 1

    assert draws_once_more("first")
    assert not draws_once_more("again")
    assert (tmp_path / "first.svg").read_bytes() == (tmp_path / "again.svg").read_bytes()
    nudged = record.envelope + np.eye(1, record.envelope.size, 7)[0] * 1e-15
    assert draws_once_more("data", record=view("measured", envelope=nudged))
    assert draws_once_more("argument", title="two")
    assert draws_once_more("source", "srbval.storage.content_store.content_version", lambda *_, **__: "new")
    assert draws_once_more("style", style, "STYLE_FILE", lines)
    assert draws_once_more("library", style, "version_of", lambda _: "new")


def test_the_tallest_line_survives_thinning(tmp_path):
    top = max(rows_of(draw("spectrum", tmp_path)), key=lambda row: float(row["amplitude"]))
    assert (float(top["frequency_hz"]), float(top["amplitude"])) == (pytest.approx(128.1), 30.0)


def test_the_cage_ratio_s_picture_has_each_record_at_its_place_with_its_interval():
    places = [("record", "B"), ("record", "H"), *((of, "") for of in ("mean", "paper", "rig", "kinematics"))]
    rows = [
        {"of": of, "state": state, "nominal_rpm": rpm, "ratio": 0.431 + rpm / 1e7, "low": 0.4305, "high": 0.4318}
        for rpm in (877.0, 353.0)
        for of, state in places
    ]
    with figure_style():
        figure, columns = draw_cage_ratios(rows)
    slow, fast = figure.axes
    assert [label.get_text() for label in slow.get_xticklabels()] == ["H", "B", "mean"]
    assert slow.get_xlabel() == "Record of the rig, 353 rpm"
    for axes, rpm in ((slow, 353), (fast, 877)):
        bars = axes.containers
        assert [bar.lines[0].get_xdata()[0] for bar in bars] == [1, 0, 2]
        assert bars[0].lines[0].get_ydata()[0] == pytest.approx(0.431 + rpm / 1e7)
        assert bars[0].lines[2][0].get_segments()[0][:, 1] == pytest.approx((0.4305, 0.4318))
    assert columns["ratio"] == [row["ratio"] for row in rows]


def test_drawing_leaves_the_user_s_matplotlib_alone(tmp_path):
    import matplotlib as mpl

    before, pyplot_was_there = dict(mpl.rcParams), "matplotlib.pyplot" in sys.modules
    draw("acceleration", tmp_path)
    assert dict(mpl.rcParams) == before
    assert ("matplotlib.pyplot" in sys.modules) is pyplot_was_there
