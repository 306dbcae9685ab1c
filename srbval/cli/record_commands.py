"""Commands ``srbval analyse``, ``trend``, ``features`` and ``identify``, which read recordings and runs."""

import argparse
import math
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from srbval.bearing import DEFAULT_BEARING, Fault
from srbval.cli.data_command import LONGEST_LINE, recording_settings
from srbval.cli.machine_file import machine_toml
from srbval.cli.output import own_command, print_result, print_wrapped, write_text
from srbval.diagnosis.baseline import load_healthy
from srbval.diagnosis.long_records import LongAnalysis
from srbval.diagnosis.records import RecordReading, RecordRequest, feature_table, read_record
from srbval.errors import ConfigurationError, DataError
from srbval.monitoring import batch
from srbval.monitoring.batch import FailedFile
from srbval.monitoring.feature_rows import record_features
from srbval.monitoring.trend import RMS, ChannelTrend, Trend, trend_of, zone_boundaries, zone_of
from srbval.progress import ProgressDisplay
from srbval.progress.tables import format_uncertain, text_rows, text_table
from srbval.reading.features import features_of
from srbval.reading.pipeline import SQUARED_UNIT
from srbval.recordings.file_times import record_times
from srbval.recordings.raw import printable
from srbval.recordings.registry import recording_of
from srbval.signal.envelope import FILTER_IN_WORDS
from srbval.storage.files import atomic_write, check_suffix
from srbval.storage.installation import import_library
from srbval.storage.json_files import to_json

if TYPE_CHECKING:
    from srbval.path.identify import Identified

DETECTED_LINE_COLUMNS = ("line", "part", "found Hz, ± 95 %", "times noise", "modulation %", "harmonics")
LINE_COLUMNS = ("line", "calc. Hz", "found Hz ± 95 %", "dev. %", "S/N", "p", "id. %", "detected")
RECORD_COLUMNS = {"file": "file", "state": "state", "strongest fault": "strongest_fault"}
RECORD_COLUMNS |= {"%": "probability", "line": "line", "Hz": "found_hz", "times noise": "snr", "alarm": "alarm"}
ALARM_LEGEND = "%: probability of the fault. alarm: yes = a fault was identified; check = a strong line is unexplained."
CAGE_PART = "cage"
MAX_CAUTIONS, LONGEST_FILE = 2, 40
MAX_TREND_ROWS = 10  # printed rows per channel, evenly spaced; plus the last record and the first alarm
SINGLE_ONLY = ("plot", "defect", "all")  # options that need a single file
PATH_COLUMNS = {"Hz": "frequency_hz", "gain along the load": "load", "across it": "cross", "u dB": "u_db"}
PATH_COLUMNS |= {"record dB": "record_db", "ring dB": "ring_load_db", "ring, across dB": "ring_cross_db"}


def request_from_options(options: argparse.Namespace) -> RecordRequest:
    """Convert options to a request to read and analyse a file; the caller adds the file's name."""
    alike = ("bearing", "auto_band", "one_band", "healthy", "healthy_scale")
    return RecordRequest(
        **{name: value for name in alike if (value := getattr(options, name, None)) is not None},
        settings=recording_settings(options),
        largest_slip_pct=options.cage_slip,
        band_hz=(options.band[0], options.band[1]) if options.band else None,
    )


def run_analyse_command(options: argparse.Namespace) -> int:
    """Analyse one file and print its verdict, or several and print a table; exit code 3 if some could not be read."""
    if options.write_machine:
        check_suffix(Path(options.write_machine), "TOML", (".toml",))
    many = options.one_machine or len(options.files) > 1 or Path(options.files[0]).is_dir()
    code = (_run_many if many else _run_one)(options)
    if options.write_machine:
        path = Path(options.write_machine)
        write_text(path, machine_toml(path.stem, vars(options), path.parent))
    return code


def run_features_command(options: argparse.Namespace) -> int:
    """Write a table of vibration features, one row per record; exit code 3 if some records could not be read."""
    path = Path(options.output)
    check_suffix(path, "CSV, Parquet or Feather", (".csv", ".parquet", ".feather"))
    kind = path.suffix.lower().removeprefix(".") or "csv"
    if kind != "csv":
        import_library("pyarrow", f"a {path.suffix} file, unlike a .csv file,")
    with ProgressDisplay() as progress:
        table = record_features(options.files, request_from_options(options), jobs=options.jobs, progress=progress)
    with atomic_write(path) as part:
        getattr(table, f"to_{kind}")(part, **({"index": False} if kind == "csv" else {}))
    rows = table.astype(object).where(table.notna(), None).to_dict("records")
    failed = [row for row in rows if row["seconds"] is None]
    for row in failed:
        print(f"srbval: not read: {row['file']}: {row['reason']}", file=sys.stderr)
    text = f"{len(rows)} records, {len(failed)} of them not read; {len(table.columns)} columns: {path}"
    return print_result(options, {"features": rows, "file": path}, text, code=DataError.exit_code if failed else 0)


def _run_one(options: argparse.Namespace) -> int:
    if options.plot:
        from srbval.report.reports import PLOT, write_plot  # slow import

        check_suffix(Path(options.plot), *PLOT)
    reading = read_record(replace(request_from_options(options), file=options.files[0]))
    for caution in reading.cautions:
        print(f"srbval: {caution}", file=sys.stderr)
    if options.plot:
        write_plot(reading, Path(options.plot), command=own_command())
    zone, severity = _severity(options, features_of(reading.analysis))
    part = options.defect  # only lines of this part are printed; `line` begins their names
    line = "" if part is None else "FTF" if part == CAGE_PART else Fault(part).line or ""
    document = to_json(reading) | {"zone": zone}
    for rows in ("lines", "families"):
        document[rows] = [one for one in document[rows] if one["name"].startswith(line)]
    tables = {"lines": document["lines"], "features": document["feature_table"]}
    whole = options.all or part is not None
    return print_result(options, document, lambda: _show(reading, line, severity, whole=whole), tables=tables)


def _severity(options: argparse.Namespace, features: Mapping[str, Any]) -> tuple[str | None, str]:
    """Return the severity zone (A to D) of the RMS velocity, or None if unknown, and a sentence about the zone."""
    boundaries = options.zones_mm_s or zone_boundaries(options.machine_class)
    zone = zone_of(features["velocity_rms_mm_s"], boundaries)
    if zone is None:
        return None, f"no zone: {features['velocity_missing']}" if boundaries else ""
    low_hz, high_hz = features["velocity_band_hz"]
    whose = "your own limits" if options.zones_mm_s else f"ISO 20816-3, {options.machine_class}"
    velocity = f"velocity {features['velocity_rms_mm_s']:.2f} mm/s RMS, {low_hz:g} to {high_hz:g} Hz"
    return zone, f"zone {zone} of {whose}: {velocity}"


def _run_many(options: argparse.Namespace) -> int:
    if given := [f"--{name}" for name in SINGLE_ONLY if getattr(options, name)]:
        raise ConfigurationError(f"{' and '.join(given)}: only for a single file, not for a folder or several files.")
    try:
        documents, failed, other = read_many(options)
    except DataError:
        if not options.one_machine:
            raise
        requests = batch.requests_for(options.files, request_from_options(options))
        one = batch.diagnose_pooled(requests)  # each record is too short by itself
        found = {"machine": one, "records": [], "summary": [], "failed": [], "left_out": []}
        return print_result(options, found, str(one["sentence"]))
    machine = {"machine": batch.machine_of(documents)} if options.one_machine else {}
    rows = [batch.summary_of(document) for document in documents]
    states, files = Counter(row["state"] for row in rows), Counter(row["file"] for row in rows)
    alike = Counter(Path(file).name for file in files)

    def show() -> None:
        if machine:
            print(machine["machine"]["sentence"])
        counted = ", ".join(f"{count} {state}" for state, count in states.items())
        print(f"{len(rows)} records: {counted}; {len(failed)} files could not be read.\n")
        shown = []
        for row in rows:
            path, share, snr = Path(row["file"]), row["probability"], row["snr"]
            name = printable("/".join(path.parts[-2 if alike[path.name] > 1 else -1 :]), LONGEST_FILE)
            channel = row["channel"] if files[row["file"]] > 1 else ""
            percent, times = None if share is None else round(100 * share), None if snr is None else f"{snr:,.0f}"
            shown.append(row | {"file": f"{name} {channel}", "probability": percent, "snr": times})
        print(f"{text_rows(shown, RECORD_COLUMNS)}\n\n{ALARM_LEGEND}")

    code = report_failed(failed, other)
    document = {"records": documents, "summary": rows, "failed": failed, "left_out": other} | machine
    return print_result(options, document, show, code=code, tables={"records": rows, "failed": failed})


def read_many(options: argparse.Namespace) -> tuple[list[dict[str, Any]], list[FailedFile], list[str]]:
    """Read all files, also in folders; returns JSON documents, failed files, and names of files without recordings."""
    requests = batch.requests_for(options.files, request_from_options(options))
    with ProgressDisplay() as progress:
        documents, failed = batch.read_records(requests, jobs=options.jobs, progress=progress)
    return documents, *batch.separate_other_files(failed, options.files, documents)


def report_failed(failed: Sequence[FailedFile], other: Sequence[str]) -> int:
    """Print `failed` files with reasons and `other` files (not recordings) to standard error; return the exit code."""
    for one in failed:
        print(f"srbval: not read: {one.file}: {str(one.error).removeprefix(f'{one.file}: ')}", file=sys.stderr)
    if other:
        print(f"srbval: skipped, not recordings: {', '.join(other)}", file=sys.stderr)
    return DataError.exit_code if failed else 0


def _show(reading: RecordReading, wanted: str, severity: str, *, whole: bool) -> None:
    """Print verdict and cautions, with detected fault lines or, if `whole`, all whose name begins with `wanted`."""
    result, verdict = reading.analysis, reading.verdict
    recording, speed = result.recording, result.speed
    file = printable(recording.file or recording.name, LONGEST_LINE)
    print(verdict.answer)
    print_wrapped(*filter(None, (verdict.advice,)))
    shaft = f"shaft {format_uncertain(60 * speed.value_hz, 60 * speed.ci95_hz)} rpm ({speed.source.value})"
    print(f"{file}: {recording.origin.value}, {recording.seconds:.3g} s at {recording.fs_hz:g} Hz, {shaft}")
    if recording.cage_ratio is not None:
        print(f"cage {recording.cage_ratio:.5f} of the shaft speed, from the cage channel")
    low, high = result.processed.band_hz
    if not whole:
        print(f"band {low:g} to {high:g} Hz: {result.band.why}")
    if isinstance(result, LongAnalysis):
        print_wrapped(result.read_in)
    print(f"{severity}\n" if severity else "")
    if whole:
        _show_all(reading, wanted)
        return
    firsts = [line for line in result.lines if line.is_first]
    found = []
    for x in (line for line in firsts if line.detected):
        family, part = [y.detected for y in result.lines if y.name == x.name], Fault.of_line(x.name)
        where, depth = format_uncertain(x.found_hz, x.ci95_hz), f"{100 * (x.depth or 0.0):.0f}"
        harmonics = f"{sum(family)} of {len(family)}"
        found.append((x.name, part.label if part else CAGE_PART, where, f"{x.snr:,.0f}", depth, harmonics))
    if found:
        print(text_table(DETECTED_LINE_COLUMNS, found))
    reasons = dict.fromkeys(line.not_detected for line in firsts if line.not_detected)
    said = "; ".join(f"{', '.join(x.name for x in firsts if x.not_detected == why)} ({why})" for why in reasons)
    print_wrapped(f"{'not found' if found else 'no line found'}: {said}" if said else "all lines that were searched")
    if declared := verdict.describe_declared(recording.state):
        print(declared)
    for caution in recording.cautions[:MAX_CAUTIONS]:
        print(f"caution: {caution}")
    more = len(recording.cautions) - MAX_CAUTIONS
    print(f"{f'{more} more cautions, ' if more > 0 else ''}all lines, features, reasons: --all, --export FILE, --json")


def _show_all(reading: RecordReading, wanted: str) -> None:
    result, verdict = reading.analysis, reading.verdict
    recording, shown, (low, high) = result.recording, result.processed, result.processed.band_hz
    print_wrapped(
        result.bearing.title,
        f"band {low:g} to {high:g} Hz, {FILTER_IN_WORDS}; {shown.end_s:.3g} s dropped at each end; {result.band.why}",
        f"lines searched in {result.search}",
        f"that is {', '.join(f'{name} {low:.2f} to {high:.2f} Hz' for name, (low, high) in result.windows.items())}",
        f"lines from the squared envelope, {SQUARED_UNIT} (1 = {shown.scale:.4g} {recording.unit})",
        f"{shown.tracking.why}",
        *(f"caution: {caution}" for caution in recording.cautions),
    )
    rows = []
    for x in (line.stated() for line in result.lines if line.name.startswith(wanted)):
        p = x.false_alarm if x.detected else None  # meaningless for a peak that is not the line
        name, found = x.name if x.is_first else f"{x.harmonic} x {x.name}", format_uncertain(x.found_hz, x.ci95_hz)
        deviation = None if x.deviation_pct is None else f"{x.deviation_pct:+.3f}"
        odds = None if x.snr is None else float(f"{x.snr:.3g}"), None if p is None else float(f"{p:.2g}")
        identity = None if x.identity_probability is None else f"{100 * x.identity_probability:.1f}"
        detected = "yes" if x.detected else str(x.not_detected)
        rows.append((name, f"{x.kinematic_hz:.3f}", found, deviation, *odds, identity, detected))
    print(f"\n{text_table(LINE_COLUMNS, rows)}\n\n{text_rows(feature_table(features_of(result)))}\n")
    print_wrapped(*verdict.reasons)
    if declared := verdict.describe_declared(recording.state):
        print(declared)
    print_wrapped(*(f"  - {note}" for note in recording.notes))


def run_trend_command(options: argparse.Namespace) -> int:
    """Read the records of one machine and print the trend of its vibration; exit code 3 if some could not be read."""
    from srbval.campaign.run import case_numbers  # slow import

    if options.plot:
        check_suffix(Path(options.plot), "HTML", (".html",))
    times: Mapping[str, datetime | float] = {} if options.times else case_numbers(options.files)
    options.files, time_from = list(times) or options.files, "the campaign's cases"
    options.one_band = True  # because levels are compared
    documents, failed, other = read_many(options)
    if not times:
        files = list(dict.fromkeys(one["file"] for one in documents))
        times, time_from = record_times(files, Path(options.times) if options.times else None)
    limits = {name: getattr(options, name) for name in ("baseline", "machine_class", "zones_mm_s")}
    found = trend_of(documents, times, time_from=time_from, **limits)
    if options.plot:
        from srbval.report.reports import write_trend  # slow import

        write_trend(found, Path(options.plot), command=own_command())
    code = report_failed(failed, other)
    document: dict[str, Any] = {"trend": found, "failed": failed, "left_out": other}
    return print_result(options, document, lambda: _print_trend(found), code=code, tables={"trend": [*found.rows()]})


def _print_trend(trend: Trend) -> None:
    print(trend.answer)
    print(f"Time from {trend.time_from}; dB above the mean of the first {trend.baseline} records; *: above its limit.")
    for one in trend.channels:
        names = [name for name in one.reference if name != RMS]
        head = (f"{one.channel or ''} time".strip(), f"RMS {one.unit}", "mm/s", *(f"{name} dB" for name in names))
        last = len(one.points) - 1
        kept = {*range(0, last + 1, math.ceil((last + 1) / MAX_TREND_ROWS)), last, one.first_alarm}
        rows = [_point_row(one, point, names) for n, point in enumerate(one.points) if n in kept]
        print("\n" + text_table(head, rows))
    for why in dict.fromkeys(one.velocity_missing for one in trend.channels if one.velocity_missing):
        print(f"no zone of ISO 20816-3: {why}")


def _point_row(one: ChannelTrend, point: dict[str, Any], names: Sequence[str]) -> tuple[str, ...]:
    stars = {name: "*" if name in point["risen"] else "" for name in (*names, RMS)}
    rises = {name: one.rise_db(point["levels"], name) for name in names}
    velocity = "-" if point["velocity_rms_mm_s"] is None else f"{point['velocity_rms_mm_s']:.2f} {point['zone'] or ''}"
    shown = ("-" if x is None else f"{x:.1f}±{point['ci95_db'][n]:.1f}{stars[n]}" for n, x in rises.items())
    rms = f"{point['levels'][RMS]:.3g}{stars[RMS]}" if point["comparable"] else "other speed"
    return (one.time_text(point), rms, velocity, *shown)


def run_identify_command(options: argparse.Namespace) -> int:
    """Identify the transfer path from outer ring to sensor and print it; ``-o`` writes a file for ``--sensor-path``."""
    from srbval.path.identify import Pair, identify, path_toml, simulated_run  # slow imports
    from srbval.scene import load_scene

    if options.output:
        check_suffix(Path(options.output), "TOML", (".toml",))
    settings = recording_settings(options)
    fault = recording_of(options.file, settings)
    records = [replace(fault, state=Fault(options.defect)) if options.defect else fault]
    if options.cross_from:
        records.append(replace(recording_of(options.cross_from, settings), state=Fault.INNER))
    healthy = load_healthy(options.healthy, settings, options.healthy_scale) if options.healthy else None
    bearing = options.bearing or fault.bearing or DEFAULT_BEARING
    with ProgressDisplay() as progress:
        scene = load_scene(options.scene, {"bearing": bearing})
        pairs = [Pair(record=one, run=simulated_run(one, scene, progress=progress)) for one in records]
    found = identify(*pairs, bearing=bearing, healthy=healthy, band_hz=tuple(options.band) if options.band else None)
    if options.output:
        write_text(Path(options.output), path_toml(found.path))
    return print_result(options, to_json(found) | {"file": options.output}, lambda: _print_path(found))


def _print_path(found: "Identified") -> None:
    path = found.path
    print(f"{path.source}\nband {path.low_hz:.0f} to {path.high_hz:.0f} Hz\n")
    print(text_rows(found.bands.to_dict("records"), PATH_COLUMNS))
    if found.sidebands_db is not None:
        record, run = (" and ".join(f"{one:.1f}" for one in row) for row in found.sidebands_db.tolist())
        print(
            f"\ngain across the load over gain along it: {path.cross[0] / path.load[0]:.3g}, known to "
            f"{path.cross_u_db:.2g} dB; sidebands of the record {record} dB, of the run behind the path {run} dB"
        )
    print("\nfitted records, which no verdict may use: " + ", ".join(path.used))
    print(f"From ring to sensor, along the load, the path multiplies by {min(path.load):.2g} to {max(path.load):.2g}.")
