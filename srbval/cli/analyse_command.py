"""``srbval analyse``: recordings and simulated runs through the signal pipeline, the answer first."""

import argparse
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.cli.data_command import LONGEST_LINE, files_of, recording_settings
from srbval.cli.output import answer, own_command, print_table, print_wrapped
from srbval.diagnosis.machine import machine_toml
from srbval.diagnosis.records import (
    FailedFile,
    RecordReading,
    RecordRequest,
    feature_table,
    machine_of,
    read_record,
    read_records,
    summary_of,
    without_other_files,
)
from srbval.diagnosis.trend import zone_boundaries, zone_of
from srbval.errors import ConfigurationError, DataError
from srbval.progress import progress_display
from srbval.progress.tables import text_rows, uncertain
from srbval.reading.features import features_of
from srbval.reading.pipeline import SQUARED_UNIT
from srbval.recordings.raw import printable
from srbval.storage.files import atomic_write, check_suffix
from srbval.storage.json_files import to_json

DETECTED = ("line", "part", "found Hz, ± 95 %", "times noise", "modulation %", "harmonics")
COLUMNS = ("line", "calc. Hz", "found Hz ± 95 %", "dev. %", "S/N", "p", "id. %", "detected")
RECORDS = {
    "file": "file",
    "state": "state",
    "strongest fault": "strongest_fault",
    "probability %": "probability",
    "alarm": "alarm",
}
ALARMS_MEAN = "alarm: yes, a fault is named; check, something strong is unexplained. Probability by the record alone."
CAGE = "cage"
MOST_CAUTIONS, LONGEST_FILE = 2, 40
SINGLE_ONLY = ("plot", "defect", "all")  # options that belong to a single file


def requests_of(options: argparse.Namespace, files: Iterable[str]) -> list[RecordRequest]:
    """Request for each file, as the options state."""
    settings = recording_settings(options)
    return [
        RecordRequest(
            file=file,
            settings=settings,
            bearing=options.bearing,
            largest_slip_pct=options.cage_slip,
            band_hz=(options.band[0], options.band[1]) if options.band else None,
            auto_band=options.auto_band,
            healthy=options.healthy,
            healthy_scale=options.healthy_scale,
            background=options.background,
        )
        for file in files
    ]


def run(options: argparse.Namespace) -> int:
    """Analyse one file and print its answer, or many and print a table; exit code 3 if some could not be read."""
    if options.write_machine:
        check_suffix(Path(options.write_machine), "TOML", (".toml",))
    zone_boundaries(options.machine_class)  # reports an unknown class before anything is read
    many = options.one_machine or len(options.files) > 1 or Path(options.files[0]).is_dir()
    code = (_run_many if many else _run_one)(options)
    if options.write_machine:
        path = Path(options.write_machine)
        with atomic_write(path) as part:
            part.write_text(machine_toml(path.stem, vars(options), path.parent), encoding="utf-8")
    return code


def _run_one(options: argparse.Namespace) -> int:
    if options.plot:
        from srbval.report.reports import check_plot, write_plot  # needs the report's room

        check_plot(Path(options.plot))
    reading = read_record(requests_of(options, options.files)[0])
    for caution in reading.cautions:
        print(f"srbval: {caution}", file=sys.stderr)
    if options.plot:
        write_plot(reading, Path(options.plot), command=own_command())
    zone, severity = _severity(options, features_of(reading.analysis))
    part = options.defect  # whose lines are printed; `line` is the start of their names
    line = "" if part is None else "FTF" if part == CAGE else Fault(part).line or ""
    document = to_json(reading) | {"zone": zone}
    for rows in ("lines", "families"):
        document[rows] = [one for one in document[rows] if one["name"].startswith(line)]
    tables = {"lines": document["lines"], "features": document["feature_table"]}
    whole = options.all or part is not None
    return answer(options, document, lambda: _show(reading, line, severity, whole=whole), tables=tables)


def _severity(options: argparse.Namespace, features: Mapping[str, Any]) -> tuple[str | None, str]:
    """Zone of the velocity by the limits of the options or the machine's file, and a sentence about it."""
    boundaries = options.zones_mm_s or zone_boundaries(options.machine_class)
    zone = zone_of(features["velocity_rms_mm_s"], boundaries)
    if not boundaries:
        return None, ""
    if zone is None:
        return None, f"no zone: {features['velocity_missing']}"
    low_hz, high_hz = features["velocity_band_hz"]
    whose = "your own limits" if options.zones_mm_s else f"ISO 20816-3, {options.machine_class}"
    return (
        zone,
        f"zone {zone} of {whose}: velocity {features['velocity_rms_mm_s']:.2f} mm/s RMS, {low_hz:g} to {high_hz:g} Hz",
    )


def _run_many(options: argparse.Namespace) -> int:
    if given := [f"--{name}" for name in SINGLE_ONLY if getattr(options, name)]:
        raise ConfigurationError(f"{' and '.join(given)}: for one file at a time; a folder or more files are given.")
    documents, failed, other = read_many(options)
    machine = {"machine": machine_of(documents)} if options.one_machine else {}
    rows = [summary_of(document) for document in documents]
    states, files = Counter(row["state"] for row in rows), Counter(row["file"] for row in rows)
    names = short_names(files)

    def show() -> None:
        if machine:
            print(machine["machine"]["sentence"])
        counted = ", ".join(f"{count} {state}" for state, count in states.items())
        print(f"{len(rows)} records: {counted}; {len(failed)} files could not be read.\n")
        shown = [
            row
            | {
                "file": f"{names[row['file']]} {row['channel'] if files[row['file']] > 1 else ''}",
                "probability": None if row["probability"] is None else round(100 * row["probability"]),
            }
            for row in rows
        ]
        print(f"{text_rows(shown, RECORDS)}\n\n{ALARMS_MEAN}")

    code = report_failed(failed, other)
    document = {"records": documents, "summary": rows, "failed": failed, "left_out": other} | machine
    tables = {"records": rows, "failed": failed}
    return answer(options, document, show, code=code, status="incomplete" if failed else "", tables=tables)


def read_many(options: argparse.Namespace) -> tuple[list[dict[str, Any]], list[FailedFile], list[str]]:
    """Documents of all files, those in folders included; files that failed; and files that are no recordings."""
    files = files_of(options.files)
    with progress_display() as progress:
        documents, failed = read_records(requests_of(options, files), jobs=options.jobs, progress=progress)
    return documents, *without_other_files(failed, options.files, documents)


def report_failed(failed: Sequence[FailedFile], other: Sequence[str]) -> int:
    """Print the files that could not be read, and why, to standard error; returns the exit code."""
    for one in failed:
        print(f"srbval: not read: {one.file}: {str(one.error).removeprefix(f'{one.file}: ')}", file=sys.stderr)
    if other:
        print(f"srbval: left out, no recordings: {', '.join(other)}", file=sys.stderr)
    return DataError.exit_code if failed else 0


def short_names(files: Iterable[str]) -> dict[str, str]:
    """Short names of files in a table: the file's name, with its folder if several files have the same name."""
    alike = Counter(Path(file).name for file in files)
    parts = {file: Path(file).parts[-2 if alike[Path(file).name] > 1 else -1 :] for file in files}
    return {file: printable("/".join(part), LONGEST_FILE) for file, part in parts.items()}


def _show(reading: RecordReading, wanted: str, severity: str, *, whole: bool) -> None:
    """Print the answer, the lines detected and the cautions; with `whole` everything."""
    result, verdict = reading.analysis, reading.verdict
    recording, speed = result.recording, result.speed
    file = printable(recording.file or recording.name, LONGEST_LINE)
    print(verdict.answer)
    print_wrapped(*filter(None, (verdict.advice,)))
    rpm = uncertain(60 * speed.value_hz, 60 * speed.ci95_hz)
    print(
        f"{file}: {recording.origin.value}, {recording.seconds:.3g} s at {recording.fs_hz:g} Hz, shaft {rpm} rpm "
        f"({speed.source.value})"
    )
    if recording.cage_ratio is not None:
        print(f"cage {recording.cage_ratio:.5f} of the shaft's speed, by its own channel")
    print(f"{severity}\n" if severity else "")
    if whole:
        _show_all(reading, wanted)
        return
    firsts = [line for line in result.lines if line.is_first]
    found = [line for line in firsts if line.detected]
    if found:
        family = {x.name: [y.detected for y in result.lines if y.name == x.name] for x in found}
        print_table(
            DETECTED,
            [
                (
                    x.name,
                    part.label if (part := Fault.of_line(x.name)) else CAGE,
                    uncertain(x.found_hz, x.ci95_hz),
                    f"{x.snr:,.0f}",
                    f"{100 * (x.depth or 0.0):.0f}",
                    f"{sum(family[x.name])} of {len(family[x.name])}",
                )
                for x in found
            ],
        )
    missed = ", ".join(f"{x.name} ({x.not_detected})" for x in firsts if not x.detected)
    print(f"{'not found' if found else 'no line found'}: {missed}" if missed else "all lines that were searched")
    if declared := verdict.beside(recording.state):
        print(declared)
    for caution in recording.cautions[:MOST_CAUTIONS]:
        print(f"caution: {caution}")
    more = len(recording.cautions) - MOST_CAUTIONS
    print(f"{f'{more} more cautions, ' if more > 0 else ''}every line, features, reasons: --all, --export FILE, --json")


def _show_all(reading: RecordReading, wanted: str) -> None:
    result, verdict = reading.analysis, reading.verdict
    recording, shown = result.recording, result.processed
    print_wrapped(
        result.bearing.title,
        f"band {shown.chain}; {result.band.why}",
        f"lines searched in {result.search}",
        f"that is {', '.join(f'{name} {low:.2f} to {high:.2f} Hz' for name, (low, high) in result.windows.items())}",
        f"lines from the squared envelope, {SQUARED_UNIT} (1 = {shown.scale:.4g} {recording.unit})",
        f"{shown.tracking.why}",
        *(f"caution: {caution}" for caution in recording.cautions),
    )
    print()
    rows = []
    for x in (line.stated() for line in result.lines if line.name.startswith(wanted)):
        p = x.false_alarm if x.detected else None  # it means nothing for a peak that is not the line
        rows.append(
            (
                x.name if x.is_first else f"{x.harmonic} x {x.name}",
                f"{x.kinematic_hz:.3f}",
                uncertain(x.found_hz, x.ci95_hz),
                None if x.deviation_pct is None else f"{x.deviation_pct:+.3f}",
                None if x.snr is None else float(f"{x.snr:.3g}"),
                None if p is None else float(f"{p:.2g}"),
                None if x.identity_probability is None else f"{100 * x.identity_probability:.1f}",
                "yes" if x.detected else f"no: {x.not_detected}",
            )
        )
    print_table(COLUMNS, rows)
    print(f"\n{text_rows(feature_table(features_of(result)))}\n")
    print_wrapped(*verdict.reasons)
    if declared := verdict.beside(recording.state):
        print(declared)
    print_wrapped(*(f"  - {note}" for note in recording.notes))
