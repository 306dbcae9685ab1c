"""Pictures for a notebook, or a file of one's own: figures of several panels, or one panel on axes of one's own."""

from functools import singledispatch
from typing import Any

import numpy as np

from srbval.bearing import Bearing
from srbval.diagnosis.fault_verdict import Diagnosis
from srbval.errors import ConfigurationError
from srbval.models.run import Run
from srbval.reading.analyse import Analysis
from srbval.recordings import Origin, Recording
from srbval.report.figures import style
from srbval.report.figures.signals import ORDER_LABEL_POINTS, QUANTITIES, draw_acceleration, draw_spectrum
from srbval.report.figures.style import BLUE, extreme_indices, figure_style, legend_above, new_figure, title_panel
from srbval.report.findings.records import (
    OWN_UNITS,
    highest_of,
    marked_line,
    run_spectrum,
    signal_of,
    spectrum_view,
    views_of,
)
from srbval.report.sections.pair_figures import draw_errors
from srbval.signal import Spectrum
from srbval.validation.validate import Validation

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


def draw(of: Any, ax: Any = None, **options: Any) -> Any:
    """Draw an object onto matplotlib axes, by default onto new ones of pyplot, and return the axes.

    A recording or a run: its signal in time. An analysis: its envelope spectrum with the lines, and with those of a
    `healthy` analysis of the same band. A spectrum: up to `end_hz`. A diagnosis: the probabilities. A bearing: the
    orders of its lines with `harmonics`. A validation: the errors with their uncertainties.
    """
    with figure_style():
        if ax is None:
            from matplotlib import pyplot

            ax = pyplot.figure(figsize=style.WIDE, layout="constrained").add_subplot()
        _draw(of, ax, **options)
        return ax


@singledispatch
def _draw(of: Any, _: Any) -> None:
    raise ConfigurationError(f"{type(of).__name__}: there is no picture of it.")


@_draw.register
def _signal(of: Recording | Run, axes: Any) -> None:
    time_s, samples, unit = signal_of(of)
    origin = of.origin if isinstance(of, Recording) else Origin.SIMULATED
    shown, kept = OWN_UNITS.get(unit, unit), extreme_indices(samples, PLOTTED_BINS)
    quantity = QUANTITIES.get(shown, "acceleration") if unit in OWN_UNITS else "signal"
    axes.plot(time_s[kept], samples[kept], color=style.ORIGINS[origin][1], lw=0.8)
    axes.set(xlabel="Time, s", ylabel=f"{quantity.capitalize()}, {shown}", xlim=(time_s[0], time_s[-1]))
    title_panel(axes, origin, "", of.name if isinstance(of, Recording) else _run_title(of), pad=6.0)


@_draw.register
def _analysis(of: Analysis, axes: Any, healthy: Analysis | None = None) -> None:
    record, other = views_of(of, healthy)
    view = spectrum_view(record, other, marked_line(of))
    draw_spectrum(axes, view, LABEL_ROOM * max(highest_of(r, view.end_hz) for r in (record, other) if r is not None))
    title_panel(axes, record.origin, "", f"{of.recording.name}, envelope spectrum", pad=9.0)
    legend_above(axes, points=ORDER_LABEL_POINTS)


@_draw.register
def _spectrum(of: Spectrum, axes: Any, end_hz: float | None = None) -> None:
    end = end_hz or float(of.frequency_hz[-1])
    axes.plot(*style.plotted(of.frequency_hz, of.amplitude, end, style.BINS_SHOWN), color=BLUE, lw=0.8)
    axes.set(xlabel="Frequency, Hz", ylabel="Amplitude", xlim=(0, end))


@_draw.register
def _diagnosis(of: Diagnosis, axes: Any) -> None:
    shown = of.shown_probabilities
    axes.barh(list(shown), [100 * share for share in shown.values()], color=BLUE)
    axes.set(xlabel="Probability, %", xlim=(0, 100))
    axes.invert_yaxis()


@_draw.register
def _bearing(of: Bearing, axes: Any, harmonics: int = 3) -> None:
    for name, order in vars(of.orders).items():
        shown = [order * harmonic for harmonic in range(1, harmonics + 1)]
        axes.plot(shown, [name.upper()] * len(shown), "o-", color=BLUE, lw=0.8)
    axes.set(xlabel=f"Shaft orders of the lines of {of.name}", xlim=(0, None))


@_draw.register
def _validation(of: Validation, axes: Any) -> None:
    draw_errors(axes, of.errors_pct)


def _run_title(run: Run) -> str:
    scene = run.scene
    return f"{scene.model} model, {scene.bearing}, {scene.defect.kind.label}, {60 * scene.shaft_hz:.5g} rpm"


def plot_analysis(analysis: Analysis, healthy: Analysis | None) -> Any:
    """See `plot`; drawn in the style that is set."""
    record, _ = views_of(analysis, healthy)
    figure = new_figure((7.6, 5.4))
    upper, lower = figure.subplots(2, 1, height_ratios=(1.0, 1.5))
    draw_acceleration(upper, record, HEAD_ROOM * float(max(abs(record.acceleration).max(), record.envelope.max())))
    _analysis(analysis, lower, healthy)
    title_panel(upper, record.origin, "", f"{analysis.recording.name}, {60 * record.shaft_hz:.5g} rpm")
    title_panel(lower, record.origin, "", "envelope spectrum", pad=9.0)
    legend_above(upper)
    return figure


def plot_run(run: Run) -> Any:
    """See `plot`; drawn in the style that is set."""
    scene, time_s = run.scene, run.time_s
    cage_ratio, rate = run.cage_rad_s / scene.shaft_speed_rad_s, scene.output_rate_hz
    hz, level_db = run_spectrum(run)
    mean = float(np.mean(cage_ratio))
    reach = max(LEAST_REACH * mean, 1.1 * float(np.abs(cage_ratio - mean).max()))
    look = {"color": BLUE, "lw": 0.8}
    figure = new_figure((7.6, 6.0))
    upper, middle, lower = figure.subplots(3, 1, height_ratios=(1.2, 1.2, 0.7))
    _signal(run, upper)
    middle.plot(hz / 1e3, level_db, **look)
    middle.set(xlabel="Frequency, kHz", ylabel="dB re 1 (m/s²)²/Hz", xlim=(0, rate / 2e3))
    lower.plot(time_s, cage_ratio, color=BLUE, lw=0.9)
    lower.set(
        xlabel="Time, s", ylabel="Cage over shaft", xlim=(time_s[0], time_s[-1]), ylim=(mean - reach, mean + reach)
    )
    lower.ticklabel_format(useOffset=False)
    return figure
