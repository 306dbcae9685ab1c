"""``srbval data``: register, list, verify and download recordings."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from srbval.cli.data_settings import settings_of
from srbval.cli.output import print_json, print_table
from srbval.recordings.plain_text import plain_text
from srbval.recordings.registry import (
    Coverage,
    Listing,
    RegisteredRecording,
    Status,
    add,
    each_once,
    fetch,
    listing,
    verify,
)
from srbval.report.progress import Progress

CHANGED = 1
LONGEST_LINE = 4000


def run(options: argparse.Namespace) -> int:
    """Run one of the data commands; `verify` leaves with 1 where a file changed, is missing or truncated."""
    result = _do(options)
    if options.json:
        document = result.to_dict()
        print_json(document, status=document["status"])
    else:
        _print(result)
    bad = any(r.status in (Status.CHANGED, Status.MISSING, Status.TRUNCATED) for r in result.recordings)
    return CHANGED if options.action == "verify" and bad else 0


def _do(options: argparse.Namespace) -> Listing:
    if options.action == "list":
        return listing()
    with Progress() as progress:
        task = progress.add({"add": "Register", "verify": "Verify", "fetch": "Download"}[options.action])

        def shown(done: int, total: int, _file: str) -> None:
            progress.update(task, done / max(total, 1))

        if options.action == "add":
            return add(options.folder, progress=shown, repin=options.repin, settings=settings_of(options))
        if options.action == "verify":
            return verify(progress=shown)
        return fetch(options.name, options.output, progress=shown)


def _print(result: Listing) -> None:
    rows = [
        (
            r.file,
            r.dataset or "-",
            r.state or "-",
            r.radial_kn,
            r.axial_kn,
            r.nominal_rpm,
            r.fs_hz,
            r.seconds,
            r.status,
        )
        for r in result.recordings
    ]
    print_table(("file", "data set", "state", "radial kN", "axial kN", "rpm", "Hz", "s", "status"), rows)
    _print_reasons(result.recordings)
    for covered in result.coverage:
        _print_grid(covered)
    copies = len(rows) - len(each_once(result.recordings))
    said = f" ({copies} with the content of another, which counts once)" if copies else ""
    print(f"\n{len(rows)} files{said}; the register is {result.manifest}")


def _print_reasons(recordings: Sequence[RegisteredRecording]) -> None:
    """Why a file is not ok or what it leaves open, files of the same reason together, and how to settle it."""
    by_reason: dict[str, list[str]] = {}
    for recording in recordings:
        if recording.reason:
            by_reason.setdefault(recording.reason, []).append(recording.file)
    for reason, files in by_reason.items():
        others = f" and {len(files) - 1} more" if len(files) > 1 else ""
        print(plain_text(f"{files[0]}{others}: {reason}", LONGEST_LINE))
    if any(r.status is Status.OK and r.reason for r in recordings):
        print("What is to be settled: `srbval data add FILE|DIR OPTIONS` keeps it for these files.")


def _print_grid(covered: Coverage) -> None:
    """State and load down, nominal speed across: how many usable files there are, a dot for none."""
    speeds = list(dict.fromkeys(p.nominal_rpm for p in covered.points))
    rows: dict[tuple[str, float, float], list[str]] = {}
    for point in covered.points:
        row = rows.setdefault((point.state.value, point.radial_kn, point.axial_kn), [])
        row.append(str(len(point.files)) if point.files else ".")
    there = len(covered.points) - len(covered.missing)
    print(
        f"\n{covered.dataset}: {there} of {len(covered.points)} operating points there, {len(covered.missing)} missing"
    )
    print_table(
        ("state", "radial kN", "axial kN", *(f"{rpm:g} rpm" for rpm in speeds)),
        [(*point, *counts) for point, counts in rows.items()],
    )
