"""Plots of one object, such as a recording or an analysis, for a notebook or a picture file."""

from functools import singledispatch
from pathlib import Path
from typing import Any

from srbval.bearing import Bearing
from srbval.diagnosis.fault_verdict import Diagnosis
from srbval.errors import ConfigurationError
from srbval.models.run import Run
from srbval.reading.analyse import Analysis
from srbval.recordings import Recording
from srbval.report.figures import style
from srbval.report.figures.signals import QUANTITY_NAMES, draw_acceleration, draw_spectrum
from srbval.report.figures.style import BLUE, extreme_indices, figure_style, new_figure, title_panel
from srbval.report.findings.records import OWN_UNITS, load_signal, marked_line, record_views, spectrum_view
from srbval.report.sections.figures import HEAD_ROOM, draw_errors
from srbval.signal import Spectrum
from srbval.validation.validate import Validation

RECORD_BINS = 900


def plot(of: Any, ax: Any = None, **options: Any) -> Any:
    """Draw an object onto matplotlib axes, by default onto new axes of pyplot, and return the axes.

    A recording, a run or a file is drawn as its signal over time; an analysis as its envelope spectrum with the
    expected fault frequencies, together with the spectrum of the analysis `healthy` if given; a diagnosis as the
    probabilities of the bearing states; a bearing as its fault frequencies in shaft orders; a validation as errors with
    uncertainties; a spectrum as its amplitude over frequency.
    """
    with figure_style():
        if ax is None:
            from matplotlib import pyplot

            ax = pyplot.figure(figsize=style.WIDE, layout="constrained").add_subplot()
        _draw(of, ax, **options)
        return ax


@singledispatch
def _draw(of: Any, _: Any) -> None:
    raise ConfigurationError(f"{type(of).__name__} cannot be plotted: `help(srbval.plot)` lists the types that can be.")


@_draw.register
def _signal(of: Recording | Run | str | Path, axes: Any) -> None:
    record, samples = load_signal(of)
    unit, kept = OWN_UNITS.get(record.unit, record.unit), extreme_indices(samples, RECORD_BINS)
    quantity = QUANTITY_NAMES.get(unit, "acceleration") if record.unit in OWN_UNITS else "signal"
    axes.plot(kept / record.fs_hz, samples[kept], color=style.ORIGINS[record.origin][1], lw=0.8)
    axes.set(xlabel="Time, s", ylabel=f"{quantity.capitalize()}, {unit}", xlim=(0.0, record.seconds))
    title_panel(axes, record.origin, "", record.name, pad=6.0)


@_draw.register
def _analysis(of: Analysis, axes: Any, healthy: Analysis | None = None) -> None:
    view = spectrum_view(*record_views(of, healthy), marked_line(of))
    draw_spectrum(view, title=f"{of.recording.name}, envelope spectrum", axes=axes)


@_draw.register
def _spectrum(of: Spectrum, axes: Any) -> None:
    end = float(of.frequency_hz[-1])
    axes.plot(*style.thin_spectrum(of.frequency_hz, of.amplitude, end, style.BINS_SHOWN), color=BLUE, lw=0.8)
    axes.set(xlabel="Frequency, Hz", ylabel="Amplitude", xlim=(0, end))


@_draw.register
def _diagnosis(of: Diagnosis, axes: Any) -> None:
    shown = of.shown_probabilities
    axes.barh(list(shown), [100 * share for share in shown.values()], color=BLUE)
    axes.set(xlabel="Probability, %", xlim=(0, 100))
    axes.invert_yaxis()


@_draw.register
def _bearing(of: Bearing, axes: Any) -> None:
    for name, order in vars(of.orders).items():
        axes.plot([order, 2 * order, 3 * order], [name.upper()] * 3, "o-", color=BLUE, lw=0.8)
    axes.set(xlabel=f"Shaft orders of the lines of {of.name}", xlim=(0, None))


@_draw.register
def _validation(of: Validation, axes: Any) -> None:
    draw_errors(of.errors_pct, axes)


def analysis_figure(analysis: Analysis, healthy: Analysis | None) -> Any:
    """Draw signal and envelope of a record's middle, and below them the record's envelope spectrum (see `plot`)."""
    view = spectrum_view(*record_views(analysis, healthy), marked_line(analysis))
    record, name = view.record, analysis.recording.name
    upper, lower = new_figure((7.6, 5.4)).subplots(2, 1, height_ratios=(1.0, 1.5))
    title = f"{name}, {60 * record.shaft_hz:.5g} rpm"
    draw_acceleration(record, limit=HEAD_ROOM * record.highest, title=title, axes=upper)
    return draw_spectrum(view, title="envelope spectrum", axes=lower)[0]
