"""``srbval analyse``: one recording or simulated run through the one signal pipeline."""

import argparse
import sys
from pathlib import Path

from srbval.bearing import Fault
from srbval.cli.data_command import LONGEST_LINE, recording_settings
from srbval.cli.output import answer, own_command, print_table
from srbval.diagnosis.baseline import (
    Baseline,
    baseline_of,
    load_healthy,
    on_background,
    registered_baseline,
)
from srbval.diagnosis.fault_verdict import fault_verdict
from srbval.errors import ConfigurationError, DataError
from srbval.reading.analyse import Analysis, analyse, bearing_of
from srbval.reading.pipeline import SQUARED_UNIT
from srbval.recordings import Origin, Recording, RecordingSettings
from srbval.recordings.load import LeftOpenError
from srbval.recordings.raw import printable
from srbval.recordings.registry import load_registered
from srbval.signal import BandFilter
from srbval.storage.json_files import to_json

COLUMNS = ("line", "harmonic", "kinematic Hz", "found Hz", "± 95 %", "deviation %", "line/noise", "false alarm",
           "identity", "detected")  # fmt: skip
CAGE = "cage"
BAND_QUESTION = "no demodulation band: --band LO HI, or --auto-band"


def run(options: argparse.Namespace) -> int:
    """Analyse a file and print its lines and verdict."""
    if options.plot:
        from srbval.report.reports import check_plot, write_plot  # needs the report's room

        check_plot(Path(options.plot))
    settings = recording_settings(options)
    recording = _load(options, settings)
    healthy = load_healthy(options.healthy, settings, options.healthy_scale) if options.healthy else None
    if options.background:
        if healthy is not None:
            raise ConfigurationError(
                "--background and --healthy exclude each other: the background is a healthy record's own, so an "
                "increment over one means nothing."
            )
        recording = on_background(recording, load_healthy(options.background, settings, options.healthy_scale))
    _ask_at_once(recording, options)
    bearing = bearing_of(recording, options.bearing, largest_slip_pct=options.cage_slip)
    band = (options.band[0], options.band[1]) if options.band else None
    chosen = BandFilter(options.filter)
    result = analyse(
        recording, bearing=bearing, band_hz=band, band_filter=chosen, choose_on_record=options.auto_band,
        healthy=healthy,
    )  # fmt: skip
    baseline = None if options.background else _baseline(result, healthy)
    verdict = fault_verdict(result, baseline, all_channels=options.channel is None)
    if options.plot:
        write_plot(result, Path(options.plot), verdict=verdict, baseline=baseline, command=own_command())
    part = options.defect  # of the lines to be printed; below, how their names begin
    line = "" if part is None else "FTF" if part == CAGE else Fault(part).line or ""

    def show() -> None:
        _print(result, line)
        print("\n".join(("", f"{verdict.headline}.", *verdict.reasons)))
        if declared := verdict.beside(recording.state):
            print(declared)
        for note in recording.notes:
            print(f"  - {note}")

    document = to_json(result)
    for rows in ("lines", "families"):
        document[rows] = [one for one in document[rows] if one["name"].startswith(line)]
    document |= to_json({"fault": verdict, "verdict": verdict.sentence, "declared_state": recording.state})
    return answer(options, document, show)


def _load(options: argparse.Namespace, settings: RecordingSettings) -> Recording:
    """The record; what it leaves open is asked for with the band, which no file states."""
    try:
        return load_registered(options.file, settings)
    except LeftOpenError as error:
        if not error.band or options.band or options.auto_band:
            raise
        raise LeftOpenError(error.path, (*error.questions, BAND_QUESTION), band=False) from None


def _ask_at_once(recording: Recording, options: argparse.Namespace) -> None:
    """Refuse a record of which more than one thing is missing with one message; a single one is asked later."""
    band = options.auto_band or options.band or recording.band_hz or recording.dataset
    missing = [
        asked
        for asked, known in (
            ("no bearing: --bearing NAME | FILE.toml", recording.bearing or options.bearing),
            ("no shaft speed: --rpm R, or --tacho CHANNEL --pulses-per-rev N", recording.speed),
            (BAND_QUESTION, band or recording.origin is not Origin.MEASURED),
        )
        if not known
    ]
    if len(missing) > 1:
        raise ConfigurationError(f"{recording.name} leaves open: {'; '.join(missing)}.")


def _baseline(result: Analysis, given: Recording | None) -> Baseline | None:
    """The healthy record given, or the registered one of the same rig, speed and load, where there is one."""
    try:
        healthy = given if given is not None else registered_baseline(result)
    except DataError as error:  # an unreadable register must not hide what the file itself shows
        print(f"srbval: no healthy baseline: {error}", file=sys.stderr)
        healthy = None
    if healthy is None:
        return None
    baseline = baseline_of(result, healthy)
    for caution in (*healthy.cautions, *(baseline.remarks if given is not None else ())):
        print(f"srbval: caution: healthy baseline {healthy.file}: {caution}", file=sys.stderr)
    return baseline


def _print(result: Analysis, wanted: str) -> None:
    recording, speed, shown = result.recording, result.speed, result.processed
    file = printable(recording.file or recording.name, LONGEST_LINE)
    print(f"{file}: {recording.origin.value}, {recording.seconds:.3g} s at {recording.fs_hz:g} Hz")
    print(
        f"{result.bearing.title}; shaft {speed.value_hz * 60:.3f} ± {speed.ci95_hz * 60:.3f} rpm ({speed.source.value})"
    )
    print(f"band {shown.chain}; {result.band.why}")
    print(f"lines searched in {result.search}")
    print(f"that is {', '.join(f'{name} {low:.2f} to {high:.2f} Hz' for name, (low, high) in result.windows.items())}")
    print(f"lines from the squared envelope, {SQUARED_UNIT} (1 = {shown.scale:.4g} {recording.unit})")
    print(f"{shown.tracking.why}\n")
    for caution in recording.cautions:
        print(f"caution: {caution}")
    lines = [line.stated() for line in result.lines if line.name.startswith(wanted)]
    print_table(
        COLUMNS,
        [
            (n.name, n.harmonic, n.kinematic_hz, n.found_hz, n.ci95_hz, n.deviation_pct, n.snr, n.false_alarm,
             n.identity_probability, "yes" if n.detected else f"no: {n.not_detected}")
            for n in lines
        ],
    )  # fmt: skip
