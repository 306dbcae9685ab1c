"""Panels: pictures that are there, stamped when synthetic, the same each time, with their data beside."""

import csv
import sys

import numpy as np
import pytest
from srbval.report.figures.reliability import reliability_plot

from srbval.bearing import load_bearing
from srbval.report.figures.acceleration import acceleration_panel
from srbval.report.figures.deviation import Deviation, deviation_plot
from srbval.report.figures.files import extreme_indices
from srbval.report.figures.ladder import ladder_plot
from srbval.report.figures.scalogram import block_means, scalogram_panel
from srbval.report.figures.scene import bearing_scene
from srbval.report.figures.spectrum import envelope_spectrum_panel, fault_cursors, tall_peaks
from srbval.report.findings.bearing_views import LoadZone
from srbval.scene import paper_scene

LARGEST_BYTES = 150_000  # some twenty panels and more must fit into a page of 6 MB
SHAFT_HZ, BPFI_HZ = 11.833, 128.04
SCALOGRAM_COLUMNS = [
    f"magnitude_at_{f:.4g}_hz" for f in np.geomspace(20, 4000, 110)[np.linspace(0, 109, 40).round().astype(int)]
]


def draw_acceleration(folder, **changes):
    time = np.arange(12_288) / 61_440 + 3.0
    noise = np.random.default_rng(1).standard_normal(time.size)
    given = {
        "time_s": time,
        "acceleration": noise,
        "envelope": np.abs(noise),
        "origin": "measured",
        "window_s": (3.05, 3.15),
        "y_limits": (-6, 6),
        "period_s": 0.01,
        "period_name": "1/BPFO",
    }
    return acceleration_panel(folder, "a", **given | changes)


def draw_spectrum(folder, **changes):
    frequency = np.arange(0, 10_000) * 0.1
    noise = np.random.default_rng(2).random(frequency.size)
    noise[1281] = 30.0
    cursors = fault_cursors("BPFI", BPFI_HZ, f_max_hz=600, sideband_hz=SHAFT_HZ, sidebands=2)
    given = {
        "frequency_hz": frequency,
        "amplitude": noise,
        "shaft_hz": SHAFT_HZ,
        "origin": "simulated",
        "cursors": cursors,
        "peaks": ((128.1, 30.0),),
        "healthy": (frequency, noise / 2),
        "f_max_hz": 600.0,
        "y_limits": (0.0, 33.6),
    }
    return envelope_spectrum_panel(folder, "s", **given | changes)


def draw_scalogram(folder, **changes):
    given = {
        "time_s": np.linspace(0, 0.3, 2048),
        "frequency_hz": np.geomspace(4000, 20, 200),
        "magnitude": np.random.default_rng(3).random((200, 2048)),
        "limits": (0, 1),
        "origin": "measured",
        "window_s": (0.0, 0.3),
        "edge_s": np.full(200, 0.01),
        "period_s": 0.01,
        "line_hz": 97.0,
        "line_name": "BPFO",
    }
    return scalogram_panel(folder, "c", **given | changes)


DRAWERS = [draw_acceleration, draw_spectrum, draw_scalogram]


@pytest.mark.parametrize("draw", DRAWERS)
@pytest.mark.parametrize("origin", ["simulated", "measured", "stand-in"])
def test_only_a_stand_in_is_stamped(draw, origin, tmp_path):
    text = draw(tmp_path, origin=origin).picture.read_text("utf-8")
    assert ("SYNTHETIC STAND-IN" in text) is (origin == "stand-in")
    assert {"simulated": "Simulated", "measured": "Measured", "stand-in": "Synthetic stand-in"}[origin] in text


@pytest.mark.parametrize("draw", DRAWERS)
def test_pictures_are_small_dateless_and_the_same_each_time(draw, tmp_path):
    first, second = draw(tmp_path / "1"), draw(tmp_path / "2")
    content = first.picture.read_bytes()
    assert 5_000 < len(content) < LARGEST_BYTES
    assert content == second.picture.read_bytes()
    assert first.data.read_bytes() == second.data.read_bytes()
    assert b"<dc:date>" not in content


@pytest.mark.parametrize("draw", DRAWERS)
def test_an_unknown_origin_is_refused(draw, tmp_path):
    with pytest.raises(ValueError, match="origin 'real'"):
        draw(tmp_path, origin="real")


@pytest.mark.parametrize("draw", DRAWERS)
def test_a_title_is_text_whatever_it_holds(draw, tmp_path):
    assert draw(tmp_path, title=r"$\frac{1 <b> & " + "x" * 300).picture.stat().st_size > 0


@pytest.mark.parametrize(
    ("draw", "columns"),
    [
        (draw_acceleration, ["time_s", "acceleration_std", "envelope_std"]),
        (draw_spectrum, ["frequency_hz", "shaft_order", "amplitude", "healthy_amplitude"]),
        (draw_scalogram, ["time_s", *SCALOGRAM_COLUMNS]),
    ],
)
def test_the_plotted_data_lies_beside(draw, columns, tmp_path):
    with draw(tmp_path).data.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == columns
    assert len(rows) * (len(rows[0]) - 1) > 1000
    assert all(np.isfinite(float(value)) for row in rows for value in row.values())


def test_the_tallest_line_survives_decimation(tmp_path):
    with draw_spectrum(tmp_path).data.open(newline="") as file:
        rows = list(csv.DictReader(file))
    top = max(rows, key=lambda row: float(row["amplitude"]))
    assert float(top["frequency_hz"]) == pytest.approx(128.1)
    assert float(top["amplitude"]) == 30.0


def test_drawing_leaves_the_user_s_matplotlib_alone(tmp_path):
    import matplotlib as mpl

    before = dict(mpl.rcParams)
    pyplot_was_there = "matplotlib.pyplot" in sys.modules
    draw_acceleration(tmp_path)
    assert dict(mpl.rcParams) == before
    assert ("matplotlib.pyplot" in sys.modules) is pyplot_was_there


def test_cursors_are_named_as_the_field_does():
    names = [c.name for c in fault_cursors("BPFI", 128.0, f_max_hz=270, sideband_hz=12.0, sidebands=1)]
    assert names == ["BPFI-fr", "BPFI", "BPFI+fr", "2xBPFI-fr", "2xBPFI", "2xBPFI+fr"]


def test_extremes_keep_every_stretch_s_least_and_greatest():
    values = np.random.default_rng(4).standard_normal(10_000)
    kept = extreme_indices(values, 100)
    assert {int(values.argmin()), int(values.argmax()), 0, 9_999} <= set(kept.tolist())
    assert len(kept) <= 202
    assert np.all(np.diff(kept) > 0)


def test_block_means_keep_the_mean():
    values = np.random.default_rng(5).random((3, 1000))
    assert block_means(values, 100).mean() == pytest.approx(values.mean())
    assert block_means(values, 2000) is values


def test_a_stand_in_has_no_place_among_deviations():
    with pytest.raises(ValueError, match="'stand-in' is not one of"):
        Deviation(group="Outer ring", source="rig", kind="stand-in", deviation_pct=0.1)


def test_the_deviation_plot_keeps_each_point(tmp_path):
    points = [
        Deviation(group="Outer ring", source="paper, rig", kind="published", deviation_pct=0.207),
        Deviation(group="Inner ring", source="model", kind="simulated", deviation_pct=-0.16, ci95_pct=0.01),
    ]
    made = deviation_plot(tmp_path, "d", points=points)
    assert "+0.207" in made.picture.read_text("utf-8")
    with made.data.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(r["source"], r["deviation_pct"], r["ci95_pct"]) for r in rows] == [
        ("paper, rig", "0.207", ""),
        ("model", "-0.16", "0.01"),
    ]


def test_the_scene_shows_rollers_load_and_defect(tmp_path):
    geometry = load_bearing("skf-22240").geometry
    angle = np.linspace(-179, 179, 359)
    force = 1e4 * np.clip(np.cos(np.radians(angle)), 0.0, None)
    zone = LoadZone(
        angle_deg=angle, outer_n=force, inner_n=force, moments=1, seconds=1.0, within_deg=30.0, near_n=9.5e3, far_n=0.0,
        roller_load_share=1.0,
    )  # fmt: skip
    scene = paper_scene(defect={"kind": "outer"})
    made = bearing_scene(tmp_path, "scene", scene=scene, geometry=geometry, zone=zone)
    text = made.picture.read_text("utf-8")
    assert "± 72°" in text  # cos x is a quarter at 75.5 degrees; stretches are 12 degrees wide
    assert "124.8 kN" in text
    assert "outer-race defect" in text
    assert len(made.data.read_text("utf-8").splitlines()) == 1 + geometry.rollers_per_row


def test_tall_peaks_are_named_by_what_they_are():
    frequency = np.arange(0, 6000) * 0.1
    height = np.full(frequency.size, 0.01)
    peaks = {11.83: "fr", 96.79: "BPFO", 193.58: "2xBPFO", 102.7: "BPFO+0.50fr", 340.0: "28.73fr", 256.08: None}
    for hz, tall in zip(peaks, (1.0, 0.9, 0.5, 0.6, 0.7, 1.0), strict=True):
        height[round(10 * hz)] = tall
    height[round(10 * 500.0)] = 0.3  # below a third of the tallest
    found = tall_peaks(
        frequency, height, shaft_hz=SHAFT_HZ, orders={"fr": 1.0, "BPFO": 8.1794, "BPFI": 10.8206, "FTF": 0.4305},
        marked_hz=[BPFI_HZ, 2 * BPFI_HZ], f_max_hz=600.0,
    )  # fmt: skip
    assert {round(hz, 1): name for name, hz, _ in found} == {round(hz, 1): n for hz, n in peaks.items() if n}
    assert [tall for _, _, tall in found] == sorted((tall for _, _, tall in found), reverse=True)


def test_an_error_below_the_axis_has_an_arrow(tmp_path):
    row = {"question": "cage-speed", "model": "full", "scenes": 3, "unanswered": 0, "wall_per_simulated_s": 1.0}
    sizes = [
        len(ladder_plot(tmp_path, name, rows=[
            row | {"median_error_pct": median, "worst_error_pct": 1.0},
            row | {"model": "line", "median_error_pct": 0.5, "worst_error_pct": 2.0},
        ]).picture.read_text("utf-8"))
        for name, median in (("above", 1.1e-3), ("below", 0.9e-3))
    ]  # fmt: skip
    assert sizes[1] > sizes[0] + 200


def test_the_reliability_diagram_keeps_its_rows(tmp_path):
    rows = [
        {"said": 0.5, "right": 0.4, "low": 0.2, "high": 0.8, "records": 7},
        {"said": 0.9, "right": 0.95, "low": 0.8, "high": 1.0, "records": 9},
    ]
    files = reliability_plot(tmp_path, "r", rows=rows)
    with (tmp_path / files.data).open() as file:
        kept = list(csv.DictReader(file))
    assert [float(row["right"]) for row in kept] == [0.4, 0.95]
    assert (tmp_path / files.picture).stat().st_size < LARGEST_BYTES
