"""``srbval trend``: changes over the records of one machine, and the first alarm."""

import argparse
import math
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from srbval.campaign.folder import TABLE, read_table, result_path
from srbval.cli.analyse_command import read_many, report_failed
from srbval.cli.output import answer, own_command, print_table
from srbval.diagnosis.trend import RMS, ChannelTrend, Trend, record_times, trend_of, zone_boundaries
from srbval.storage.files import check_suffix

MOST_ROWS = 10  # printed for a channel


def run(options: argparse.Namespace) -> int:
    """Read all records and print the trend; exit code 3 if some could not be read."""
    if options.plot:
        check_suffix(Path(options.plot), "HTML", (".html",))
    zone_boundaries(options.machine_class)  # reports an unknown class before anything is read
    cases: dict[str, datetime | float] = {}
    if len(options.files) == 1 and (Path(options.files[0]) / TABLE).is_file():
        folder = Path(options.files[0])
        cases = {str(result_path(folder, case.key)): float(case.index) for case in read_table(folder).cases}
        options.files = list(cases)
    documents, failed, other = read_many(options)
    files = list(dict.fromkeys(one["file"] for one in documents))
    times, time_from = cases, "the campaign's cases"
    if not cases:
        times, time_from = record_times(files, Path(options.times) if options.times else None)
    trend = trend_of(
        documents,
        times,
        time_from=time_from,
        baseline=options.baseline,
        machine_class=options.machine_class,
        zones_mm_s=options.zones_mm_s,
    )
    rows = [
        {
            "channel": one.channel,
            "time": one.time_text(point),
            "file": point["file"],
            "rpm": point["rpm"],
            **{f"{name}_{one.unit}": point["levels"].get(name) for name in one.reference},
            "velocity_rms_mm_s": point["velocity_rms_mm_s"],
            "zone": point["zone"],
            "risen": " ".join(point["risen"]),
        }
        for one in trend.channels
        for point in one.points
    ]
    if options.plot:
        from srbval.report.reports import write_trend  # needs the report's room

        write_trend(trend, Path(options.plot), command=own_command())
    code = report_failed(failed, other)
    document: dict[str, Any] = {"trend": trend, "failed": failed, "left_out": other}
    status, tables = "incomplete" if failed else "", {"trend": rows}
    return answer(options, document, lambda: _print(trend), code=code, status=status, tables=tables)


def _print(trend: Trend) -> None:
    print(trend.answer)
    print(f"Time from {trend.time_from}; dB over the mean of the first {trend.baseline}; * above its limit.")
    for one in trend.channels:
        names = [name for name in one.reference if name != RMS]
        head = (f"{one.channel or ''} time".strip(), f"RMS {one.unit}", "mm/s", *(f"{name} dB" for name in names))
        print()
        print_table(head, [_row(one, point, names) for point in _shown(one)])
    for why in dict.fromkeys(one.velocity_missing for one in trend.channels if one.velocity_missing):
        print(f"no zone of ISO 20816-3: {why}")


def _row(one: ChannelTrend, point: dict[str, Any], names: Sequence[str]) -> tuple[str, ...]:
    stars = {name: "*" if name in point["risen"] else "" for name in (*names, RMS)}
    rises = {name: one.rise_db(point["levels"], name) for name in names}
    velocity = "-" if point["velocity_rms_mm_s"] is None else f"{point['velocity_rms_mm_s']:.2f} {point['zone'] or ''}"
    shown = ("-" if x is None else f"{x:.1f}±{point['ci95_db'][n]:.1f}{stars[n]}" for n, x in rises.items())
    rms = f"{point['levels'][RMS]:.3g}{stars[RMS]}" if point["comparable"] else "other speed"
    return (one.time_text(point), rms, velocity, *shown)


def _shown(one: ChannelTrend) -> list[dict[str, Any]]:
    """Evenly spaced points, with the first, the last and the point of the first alarm."""
    step = math.ceil(len(one.points) / MOST_ROWS)
    kept = {*range(0, len(one.points), step), len(one.points) - 1, one.first_alarm}
    return [point for n, point in enumerate(one.points) if n in kept]
