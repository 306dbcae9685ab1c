"""The page of a trend: the answer, and a picture and a table of each channel."""

from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

from srbval.diagnosis.trend import RMS, ChannelTrend, Trend
from srbval.report.blocks import Block, Report, Section, Tone
from srbval.report.figures.style import BLUE, INK, ORANGE, PURPLE, SOFT, VERMILION, Drawn, new_figure, panel
from srbval.report.section_texts import Texts
from srbval.report.sections.assemble import provenance_section

TEXTS = Texts("trend")
COLOURS, MARKS = (BLUE, VERMILION, PURPLE, ORANGE), "osD^"
MOST_MARKED = 60  # points, up to which each has its marker


def assemble_trend(trend: Trend, *, command: str, provenance: Mapping[str, Any]) -> Report:
    """The page; `command` is the one that makes it again."""
    tone = Tone.BAD if trend.alarm else Tone.GOOD if trend.comparisons else Tone.NEUTRAL
    pictures = [
        TEXTS.figure("levels", levels_panel(one), id=f"levels-{number}", one=one, trend=trend)
        for number, one in enumerate(trend.channels, start=1)
    ]
    first = trend.channels.index(trend.alarm) if trend.alarm else 0
    sections = [
        _section(one, number, () if number == first else (pictures[number],))
        for number, one in enumerate(trend.channels)
    ]
    return Report(
        title=TEXTS.text("title", trend=trend),
        subtitle=TEXTS.text("subtitle", trend=trend),
        generated_utc=datetime.now(UTC),
        verdict=TEXTS.verdict(tone, figure=pictures[first], trend=trend),
        sections=(*sections, replace(provenance_section({"command": command, **provenance}), appendix=())),
        data={"trend": trend},
    )


def _section(one: ChannelTrend, number: int, pictures: tuple[Block, ...]) -> Section:
    names = [name for name in one.reference if name != RMS]
    table = TEXTS.table("records", one.points, id=f"records-{number + 1}", one=one, names=names)
    return Section(id=f"channel-{number + 1}", title=TEXTS.text("channel", one=one), blocks=(*pictures, table))


@panel
def levels_panel(one: ChannelTrend) -> Drawn:
    """Rises of the lines' levels with their 95 % intervals and limits above, RMS or velocity below, in time."""
    figure = new_figure((5.4, 4.3), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.6, 1.0))
    times = [point.time for point in one.points]
    marked = len(times) <= MOST_MARKED
    columns: dict[str, Any] = {"time": [point.time_text for point in one.points]}
    for name, colour, mark in zip((x for x in one.reference if x != RMS), COLOURS, MARKS, strict=False):
        rises = [_number(one.rise_db(point.levels, name)) for point in one.points]
        half = [_number(point.ci95_db.get(name)) for point in one.points]
        upper.errorbar(times, rises, yerr=half, color=colour, marker=mark if marked else None, ms=3.5, lw=0.9,
                       elinewidth=0.5, label=name)  # fmt: skip
        if (limit := one.rise_db(one.limits, name)) is not None:
            upper.axhline(limit, color=colour, ls="--", lw=0.8)
        columns |= {f"{name}_db": rises, f"{name}_ci95_db": half}
    if one.first_alarm is not None:
        upper.axvline(times[one.first_alarm], color=INK, lw=1.0, ls=":")
    upper.set_ylabel("Level over baseline, dB")
    if one.reference.keys() > {RMS}:
        upper.legend(loc="upper left", ncols=len(COLOURS))
    velocity = [point.velocity_rms_mm_s for point in one.points]
    shown = [point.levels[RMS] for point in one.points] if None in velocity else velocity
    lower.plot(times, shown, color=SOFT, marker="o" if marked else None, ms=3.5, lw=0.9)
    lower.set_ylabel(f"RMS, {one.unit}" if None in velocity else "Velocity RMS, mm/s")
    for zone, least in () if None in velocity else one.zones:
        lower.axhline(least, color=ORANGE, lw=0.8)
        lower.annotate(f"zone {zone}", (1.0, least), xycoords=("axes fraction", "data"), ha="right", va="bottom",
                       fontsize=7)  # fmt: skip
    lower.set_xlabel("Time" if isinstance(times[0], datetime) else "Record")
    if isinstance(times[0], datetime):
        from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

        locator = AutoDateLocator(minticks=2, maxticks=6)  # with more at least, five months have no interval
        lower.xaxis.set_major_locator(locator)
        lower.xaxis.set_major_formatter(ConciseDateFormatter(locator))
    return figure, columns | {"rms_or_velocity": shown}


def _number(value: float | None) -> float:
    return float("nan") if value is None else value
