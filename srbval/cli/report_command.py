"""``srbval report``: the main job, or with files a report on these recordings."""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbval.cli.data_command import files_of, recording_settings
from srbval.cli.output import answer, own_command
from srbval.errors import ConfigurationError, DataError, SrbvalError
from srbval.progress import Progress, ProgressDisplay, stage
from srbval.storage.json_files import to_json

MAIN_FOLDER = "srbval-report"
MOST_SECTIONS = 6  # recordings that have their own; a folder's others have a row
LONGEST_NAME = 100  # characters of a file's name in its folder's, which file systems limit


def run(options: argparse.Namespace) -> int:
    """Gather, analyse, compare, write; prints where the files are.

    Exit code 1 where a tolerance is missed, 3 where some of the recordings could not be read or analysed.
    """
    first, more = [Path(file).stem[:LONGEST_NAME] for file in options.files[:1]], len(options.files) - 1
    usual = "-".join([MAIN_FOLDER, *first, *([f"and-{more}-more"] if more > 0 else ())])
    folder = Path(usual if options.output is None else options.output)
    settings = recording_settings(options)
    if not options.files and (settings or options.healthy or options.band or options.cage_slip):
        raise ConfigurationError(
            "options for recordings are given, but no recording; name it too, for example: srbval report FILE.csv"
        )
    started = time.perf_counter()
    with ProgressDisplay() as progress:
        files, found = (_own if options.files else _main)(options, folder, progress)
    summary = {kind: str(path) for kind, path in files.items()} | {"figures": str(folder / "figures")}
    failed = found.get("failed", ())
    code = DataError.exit_code if failed else 0 if options.files or found["headline"]["holds"] else 1
    document = summary | {"wall_s": time.perf_counter() - started} | found
    for one in failed:
        print(f"srbval: not in the report: {one['file']}: {one['reason']}", file=sys.stderr)
    return answer(options, document, "\n".join(summary.values()), code=code)


def _main(options: argparse.Namespace, folder: Path, progress: Progress) -> tuple[dict[str, Path], dict[str, Any]]:
    with stage(progress, "Load the program"):
        from srbval.report.reports import make_report
        from srbval.studies.harness import pages
    found, files = make_report(
        folder,
        seconds=options.seconds,
        jobs=options.jobs,
        formats=tuple(options.formats),
        pages=pages(),
        command=own_command(),
        progress=progress,
    )
    return files, {"headline": to_json(found.data["headline"]), "table6": found.data["table6"]}


def _own(options: argparse.Namespace, folder: Path, progress: Progress) -> tuple[dict[str, Path], dict[str, Any]]:
    with stage(progress, "Load the program"):
        from srbval.cli.record_commands import request_of
        from srbval.diagnosis.baseline import load_healthy
        from srbval.diagnosis.records import FailedFile, read_records, summary_of, without_other_files
        from srbval.recordings import Recording
        from srbval.recordings.registry import load_registered
        from srbval.report.reports import report_recordings
    request = request_of(options)
    settings, band_hz = request.settings, request.band_hz
    files, documents, shown = files_of(options.files), list[dict[str, Any]](), list[dict[str, Any]]()
    failed: list[FailedFile] = []
    if files != options.files or len(files) > MOST_SECTIONS:
        requests = [replace(request, file=file) for file in files]
        documents, failed = read_records(requests, jobs=options.jobs, progress=progress)
        failed, _ = without_other_files(failed, options.files, documents)
        alarms = sum(summary_of(one)["alarm"] in ("yes", "check") for one in documents)
        shown = documents[: max(1, min(alarms, MOST_SECTIONS))]
        files = [one["file"] for one in shown]
    is_open = len({one["file"] for one in documents}) < len(documents)  # a document a channel

    def read(file: str, channel: str | None) -> Recording | FailedFile:
        try:
            return load_registered(file, replace(settings, channel=channel or settings.channel), band_hz)
        except SrbvalError as error:
            return FailedFile(file=file, error=error)

    channels = [one["channel"] if is_open else None for one in shown] or [None] * len(files)
    report, written = report_recordings(
        [*map(read, files, channels), *failed],
        folder,
        healthy=load_healthy(options.healthy, settings, options.healthy_scale) if options.healthy else None,
        all_channels=options.channel is None and not is_open,
        others=documents[len(shown) :],
        formats=tuple(options.formats),
        command=own_command(),
        progress=progress,
        bearing=options.bearing,
        largest_slip_pct=options.cage_slip,
        band_hz=band_hz,
    )
    return written, to_json(report.data)
