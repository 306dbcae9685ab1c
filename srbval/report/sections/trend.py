"""Page on the trend of a machine's records: a verdict on risen levels, and a figure for each channel."""

from collections.abc import Iterator, Mapping
from datetime import datetime
from typing import Any

import numpy as np

from srbval.monitoring.trend import RMS, ChannelTrend, Trend
from srbval.report.blocks import Figure, Report, Tone, VerdictBox
from srbval.report.figures.style import BLUE, INK, ORANGE, PURPLE, SOFT, VERMILION, Panel, PanelData, new_figure
from srbval.report.prose import Prose, literal
from srbval.report.sections.assemble import provenance_section

TREND_TEXTS = Prose("srbval.report", "texts/trend.md")
COLOURS, LINE_MARKERS = (BLUE, VERMILION, PURPLE, ORANGE), "osD^"
MAX_MARKED = 60  # points of a curve that is drawn with a marker at each point


def assemble_trend(trend: Trend, origin: Mapping[str, Any]) -> Report:
    """Build the page of a trend; `origin` is its provenance and the command that repeats it."""
    tone = Tone.BAD if trend.alarm else Tone.GOOD if trend.comparisons else Tone.NEUTRAL
    pictures = [_levels(trend, one, f"levels-{number}") for number, one in enumerate(trend.channels, start=1)]
    first = pictures.pop(trend.channels.index(trend.alarm) if trend.alarm else 0)
    return Report(
        title=TREND_TEXTS.text("title", records=len(trend.channels[0].points)),
        subtitle=TREND_TEXTS.text("subtitle", time_from=trend.time_from),
        verdict=VerdictBox(tone=tone, headline=literal(trend.answer), points=tuple(trend_points(trend)), figure=first),
        sections=(TREND_TEXTS.section(*pictures), provenance_section(origin)),
    )


def trend_points(trend: Trend) -> Iterator[str]:
    """State the false-alarm probability, why severity zones (ISO 20816-3) are missing, and how levels are defined."""
    if trend.comparisons:
        each, all_pct = trend.false_alarm / trend.comparisons, 100 * trend.false_alarm
        yield TREND_TEXTS.text("how-sure", trend=trend, each=each, all_pct=all_pct)
    if reasons := dict.fromkeys(one.velocity_missing for one in trend.channels if one.velocity_missing):
        yield TREND_TEXTS.text("no-zone", reasons="; ".join(reasons))
    yield TREND_TEXTS.text("level")


def _levels(trend: Trend, one: ChannelTrend, name: str) -> Figure:
    first, has_velocity = one.first_alarm, one.points[0]["velocity_rms_mm_s"] is not None
    marks = ["; dashed, the limits"] * bool(one.limits) + ["; dotted, the first alarm"] * (first is not None)
    return TREND_TEXTS.figure(
        "levels",
        Panel(draw_levels, one),
        id=name,
        marks="".join(marks),
        channel=f"Channel {one.channel}. " if one.channel else "",
        of_channel=f" of channel {one.channel}" if one.channel else "",
        names=", ".join(level for level in one.reference if level != RMS),
        below="velocity within the band of ISO 20816-3" if has_velocity else "RMS of the channel",
        alarm="no alarm" if first is None else f"first alarm at {one.time_text(one.points[first])}",
        baseline=trend.baseline,
        records=len(one.points),
    )


def draw_levels(one: ChannelTrend) -> PanelData:
    """Draw rise and alarm limit of fault lines [dB] over time; below, RMS of velocity or, if unknown, of the signal."""
    figure = new_figure((5.4, 4.3))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.6, 1.0))
    times = [point["time"] for point in one.points]
    marked = len(times) <= MAX_MARKED
    columns: dict[str, Any] = {"time": [one.time_text(point) for point in one.points]}
    for name, colour, mark in zip((x for x in one.reference if x != RMS), COLOURS, LINE_MARKERS, strict=False):
        rises = np.array([one.rise_db(point["levels"], name) for point in one.points], dtype=float)  # None: NaN
        half = np.array([point["ci95_db"].get(name) for point in one.points], dtype=float)
        look = {"color": colour, "marker": mark if marked else None, "ms": 3.5, "lw": 0.9, "elinewidth": 0.5}
        upper.errorbar(times, rises, yerr=half, label=name, **look)
        if (limit := one.rise_db(one.limits, name)) is not None:
            upper.axhline(limit, color=colour, ls="--", lw=0.8)
        columns |= {f"{name}_db": rises, f"{name}_ci95_db": half}
    if one.first_alarm is not None:
        upper.axvline(times[one.first_alarm], color=INK, lw=1.0, ls=":")
    upper.set_ylabel("Level over baseline, dB")
    if one.reference.keys() > {RMS}:
        upper.legend(loc="upper left", ncols=len(COLOURS))
    velocity = [point["velocity_rms_mm_s"] for point in one.points]
    shown = [point["levels"][RMS] for point in one.points] if None in velocity else velocity
    lower.plot(times, shown, color=SOFT, marker="o" if marked else None, ms=3.5, lw=0.9)
    lower.set_ylabel(f"RMS, {one.unit}" if None in velocity else "Velocity RMS, mm/s")
    right = {"xycoords": ("axes fraction", "data"), "ha": "right", "va": "bottom", "fontsize": 7}
    for zone, least in () if None in velocity else one.zones:
        lower.axhline(least, color=ORANGE, lw=0.8)
        lower.annotate(f"zone {zone}", (1.0, least), **right)
    lower.set_xlabel("Time" if isinstance(times[0], datetime) else "Record")
    if isinstance(times[0], datetime):
        from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

        locator = AutoDateLocator(minticks=2, maxticks=6)  # a larger minimum leaves five months without ticks
        lower.xaxis.set_major_locator(locator)
        lower.xaxis.set_major_formatter(ConciseDateFormatter(locator))
    return figure, columns | {"rms_or_velocity": shown}
