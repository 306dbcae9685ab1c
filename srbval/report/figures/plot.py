"""Pictures for a notebook, or a file of one's own: of an analysis and of a run, as matplotlib figures."""

from typing import Any

import numpy as np

from srbval.models.run import Run
from srbval.reading.analyse import Analysis
from srbval.report.figures.signals import ORDER_LABEL_POINTS, draw_acceleration, draw_spectrum
from srbval.report.figures.style import BLUE, extreme_indices, figure_style, legend_above, new_figure, title_panel
from srbval.report.findings.records import highest_of, marked_line, run_spectrum, spectrum_view, views_of

HEAD_ROOM, LABEL_ROOM = 1.12, 2.0  # over the highest value: of a signal in time, of a spectrum with labelled lines
PLOTTED_BINS = 900
LEAST_REACH = 1e-3  # of the cage speed's axis, as a share of its mean: rounding is not drawn as a movement


def plot(of: Run | Analysis, *, healthy: Analysis | None = None) -> Any:
    """A matplotlib figure of a run or an analysis. Notebooks show what this returns; ``savefig`` writes it.

    A run: acceleration along the sensor's axis, its spectrum, the cage's speed. An analysis: the middle of the record
    with its envelope, and the envelope spectrum with its lines; `healthy`, read in the same band, is drawn dashed.
    """
    with figure_style():
        return plot_run(of) if isinstance(of, Run) else plot_analysis(of, healthy)


def plot_analysis(analysis: Analysis, healthy: Analysis | None) -> Any:
    """See `plot`; drawn in the style that is set."""
    record, other = views_of(analysis, healthy)
    view = spectrum_view(record, other, marked_line(analysis))
    figure = new_figure((7.6, 5.4))
    upper, lower = figure.subplots(2, 1, height_ratios=(1.0, 1.5))
    draw_acceleration(upper, record, HEAD_ROOM * float(max(abs(record.acceleration).max(), record.envelope.max())))
    draw_spectrum(lower, view, LABEL_ROOM * max(highest_of(r, view.end_hz) for r in (record, other) if r is not None))
    title_panel(upper, record.origin, "", f"{analysis.recording.name}, {60 * record.shaft_hz:.5g} rpm")
    title_panel(lower, record.origin, "", "envelope spectrum", pad=9.0)
    legend_above(upper)
    legend_above(lower, points=ORDER_LABEL_POINTS)
    return figure


def plot_run(run: Run) -> Any:
    """See `plot`; drawn in the style that is set."""
    scene, time_s = run.scene, run.time_s
    cage_ratio, rate = run.cage_rad_s / scene.shaft_speed_rad_s, scene.output_rate_hz
    acceleration, hz, level_db = run_spectrum(run)
    kept = extreme_indices(acceleration, PLOTTED_BINS)
    mean = float(np.mean(cage_ratio))
    reach = max(LEAST_REACH * mean, 1.1 * float(np.abs(cage_ratio - mean).max()))
    look = {"color": BLUE, "lw": 0.8}
    figure = new_figure((7.6, 6.0))
    upper, middle, lower = figure.subplots(3, 1, height_ratios=(1.2, 1.2, 0.7))
    upper.plot(time_s[kept], acceleration[kept], **look)
    upper.set(xlabel="Time, s", ylabel="Acceleration, m/s²", xlim=(time_s[0], time_s[-1]))
    middle.plot(hz / 1e3, level_db, **look)
    middle.set(xlabel="Frequency, kHz", ylabel="dB re 1 (m/s²)²/Hz", xlim=(0, rate / 2e3))
    lower.plot(time_s, cage_ratio, color=BLUE, lw=0.9)
    lower.set(
        xlabel="Time, s", ylabel="Cage over shaft", xlim=(time_s[0], time_s[-1]), ylim=(mean - reach, mean + reach)
    )
    lower.ticklabel_format(useOffset=False)
    what = f"{scene.model} model, {scene.bearing}, {scene.defect.kind.label}, {60 * scene.shaft_hz:.5g} rpm"
    title_panel(upper, "simulated", "", what, pad=6.0)
    return figure
