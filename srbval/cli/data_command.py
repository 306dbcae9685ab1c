"""Command ``srbval data``: register, list, verify, remove and download recordings."""

import argparse
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbval.cli.output import print_result
from srbval.errors import ConfigurationError
from srbval.progress import ProgressDisplay
from srbval.progress.tables import text_table
from srbval.recordings import RecordingSettings, registry
from srbval.recordings.datasets.description import known_datasets
from srbval.recordings.manifest import FileStatus, RegisteredRecording, manifest_path, without_copies
from srbval.recordings.raw import printable
from srbval.recordings.registry import RegisterListing, fetch
from srbval.recordings.settings import ALIASES, settings_of

DAMAGED_STATUSES = (FileStatus.CHANGED, FileStatus.MISSING, FileStatus.TRUNCATED)
LONGEST_LINE = 4000
POINT = ("state", "radial_kn", "axial_kn", "nominal_rpm")  # operating point in a data set's grid [kN, rpm]
DATA_HEADER = ("file", "data set", "bearing", "state", "radial kN", "axial kN", "set rpm", "rpm", "Hz", "s", "status")


def run_data_command(options: argparse.Namespace) -> int:
    """Run one action of ``srbval data``; `verify` returns exit code 1 if a file is changed, missing or truncated."""
    result = _run_action(options)
    coverage = list(_coverage(result.recordings))
    document = {
        "status": "problems" if result.problems else "ok",
        "manifest": str(manifest_path()),
        "recordings": result.recordings,
        "left_out": [{"file": entry.file, "reason": entry.reason} for entry in result.left_out],
        "coverage": coverage,
    }
    damaged = options.action == "verify" and any(r.status in DAMAGED_STATUSES for r in result.recordings)
    if options.action == "remove":
        files = "\n".join(printable(r.file, LONGEST_LINE) for r in result.recordings)
        return print_result(options, document, f"{files}\nremoved from the register {manifest_path()}; the files stay")
    return print_result(options, document, lambda: _print(result, coverage), code=1 if damaged else 0)


def recording_settings(options: argparse.Namespace) -> RecordingSettings:
    """Build `RecordingSettings` from the options that describe a recording."""
    known = set(ALIASES.values()) - {"band_hz", "auto_band"}  # options of the analysis; only `data add` stores them
    given = {ALIASES.get(name, name): value for name, value in vars(options).items()}
    return settings_of({name: value for name, value in given.items() if name in known})


def _run_action(options: argparse.Namespace) -> RegisterListing:
    if options.action == "list":
        return registry.listing()
    if options.action == "remove":
        return registry.remove(options.name)
    with ProgressDisplay() as progress:
        if options.action == "add":
            band_hz = (options.band[0], options.band[1]) if options.band else None
            settings = replace(recording_settings(options), band_hz=band_hz, auto_band=options.auto_band or None)
            if options.folder is None and options.table is None:
                raise ConfigurationError("name a folder or a file to register, or a --table of them.")
            folder = Path(options.table).parent if options.folder is None else options.folder
            return registry.add(folder, progress=progress, repin=options.repin, settings=settings, table=options.table)
        if options.action == "verify":
            return registry.verify_recordings(progress=progress)
        return fetch(options.name, options.output, progress=progress)


def _coverage(recordings: Sequence[RegisteredRecording]) -> Iterator[dict[str, Any]]:
    """Yield every data set that has registered files, with its operating points and the usable files of each point."""
    for known in known_datasets():
        own = [entry for entry in recordings if entry.dataset == known.name]
        usable = [entry for entry in own if entry.status is FileStatus.OK]
        points = [
            dict(zip(POINT, point, strict=True)) | {"files": [r.file for r in usable if r.operating_point == point]}
            for point in known.operating_points
        ]
        if own and points:
            yield {"dataset": known.name, "points": points, "missing": sum(not point["files"] for point in points)}


def _print(result: RegisterListing, coverage: Sequence[dict[str, Any]]) -> None:
    rows = [
        (r.file, r.dataset, r.bearing, *r.operating_point, r.rpm and round(r.rpm, 1), r.fs_hz, r.seconds, r.status)
        for r in result.recordings
    ]
    print(text_table(DATA_HEADER, rows))
    _print_reasons(result.recordings)
    if result.left_out:
        print("\nnot registered, because they are not recordings:")
        _print_reasons(result.left_out)
    for known in coverage:
        points, missing = len(known["points"]), known["missing"]
        print(f"\n{known['dataset']}: {points - missing} of {points} operating points present, {missing} missing")
    copies = len(rows) - len(without_copies(result.recordings))
    counted = f" ({copies} are copies of other files and count once)" if copies else ""
    print(f"\nrecordings: {len(rows)}{counted}; the register is {manifest_path()}")


def _print_reasons(recordings: Sequence[RegisteredRecording]) -> None:
    """Print why files cannot be used, cautions on usable files, and the command that adds missing information."""
    by_reason = defaultdict[str, list[str]](list)
    for recording in recordings:
        for said in filter(None, (recording.reason, *(f"caution: {c}" for c in recording.cautions or ()))):
            by_reason[said].append(recording.file)
    for reason, files in by_reason.items():
        others = f" and {len(files) - 1} more" if len(files) > 1 else ""
        print(printable(f"{files[0]}{others}: {reason}", LONGEST_LINE))
    if any(r.status is FileStatus.OK and r.reason for r in recordings):
        print("To supply missing information for these files: `srbval data add FILE|DIR OPTIONS`.")
