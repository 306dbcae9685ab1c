"""``srbval analyse``: one recording or simulated run through the one signal pipeline."""

import argparse
import sys

from srbval.bearing import DEFECTS, Bearing, load_bearing
from srbval.cli.data_command import recording_settings
from srbval.cli.output import print_json, print_table
from srbval.errors import ConfigurationError, DataError
from srbval.recordings import Recording, RecordingSettings
from srbval.recordings.registry import healthy_baseline, load_registered
from srbval.signal import BandFilter
from srbval.storage.strict_json import json_object
from srbval.validation.analyse import Analysis, analyse
from srbval.validation.fault_call import FaultCall, call_fault
from srbval.validation.pipeline import SQUARED_UNIT

COLUMNS = ("line", "harmonic", "kinematic Hz", "found Hz", "± 95 %", "deviation %", "line/noise", "false alarm",
           "identity", "detected")  # fmt: skip
LINE_OF_PART = {**{fault.value: fault.line or "" for fault in DEFECTS}, "cage": "FTF"}


def run(options: argparse.Namespace) -> int:
    """Analyse a file and print its lines and verdict."""
    recording = load_registered(options.file, recording_settings(options))
    bearing = load_bearing(options.bearing) if options.bearing else _bearing_of(recording)
    band = (options.band[0], options.band[1]) if options.band else None
    chosen = BandFilter(options.filter)
    result = analyse(recording, bearing=bearing, band_hz=band, band_filter=chosen, choose_on_record=options.auto_band)
    call = _call(result)
    if options.json:
        print_json(_selected(result, options.defect) | {"fault": call})
    else:
        _print(result, options.defect)
        print(call.sentence)
    return 0


def _call(result: Analysis) -> FaultCall:
    """Against the registered healthy record of the same rig, speed and load, where there is one."""
    try:
        entry = healthy_baseline(result.recording)
        healthy = (
            None if entry is None else load_registered(entry.file, RecordingSettings(channel=result.recording.channel))
        )
    except DataError as error:  # an unreadable register must not hide what the file itself shows
        print(f"srbval: no healthy baseline: {error}", file=sys.stderr)
        healthy = None
    if healthy is None:
        return call_fault(result)
    for caution in healthy.cautions:
        print(f"srbval: caution: healthy baseline {healthy.file}: {caution}", file=sys.stderr)
    band, chosen = result.processed.band_hz, result.processed.band_filter
    return call_fault(result, analyse(healthy, bearing=result.bearing, band_hz=band, band_filter=chosen))


def _bearing_of(recording: Recording) -> Bearing:
    if recording.own_bearing is not None:
        return recording.own_bearing
    if recording.bearing is None:
        raise ConfigurationError(
            f"{recording.name}: neither the file nor its data set names the bearing; give --bearing: a known one "
            "(srbval bearing list) or a TOML file."
        )
    return load_bearing(recording.bearing)


def _selected(result: Analysis, defect: str | None) -> dict[str, object]:
    document = json_object(result)
    if defect is not None:
        document["lines"] = [line for line in document["lines"] if line["name"].startswith(LINE_OF_PART[defect])]
    return document


def _print(result: Analysis, defect: str | None) -> None:
    recording, speed, shown = result.recording, result.speed, result.processed
    print(f"{recording.file}: {recording.origin.value}, {recording.seconds:.3g} s at {recording.fs_hz:g} Hz")
    print(
        f"{result.bearing.title}; shaft {speed.value_hz * 60:.3f} ± {speed.ci95_hz * 60:.3f} rpm ({speed.source.value})"
    )
    print(f"band {shown.chain}; {result.band.why}")
    print(f"lines searched in {result.search}")
    print(f"that is {', '.join(f'{w.name} {w.low_hz:.2f} to {w.high_hz:.2f} Hz' for w in result.windows)}")
    print(f"lines from the squared envelope, {SQUARED_UNIT} (1 = {shown.scale:.4g} {recording.unit})")
    print(f"{shown.tracking.why}\n")
    for caution in recording.cautions:
        print(f"caution: {caution}")
    wanted = LINE_OF_PART[defect] if defect else ""
    lines = [line.stated() for line in result.lines if line.name.startswith(wanted)]
    print_table(
        COLUMNS,
        [
            (n.name, n.harmonic, n.kinematic_hz, n.found_hz, n.ci95_hz, n.deviation_pct, n.snr, n.false_alarm,
             n.identity_probability, "yes" if n.detected else "no")
            for n in lines
        ],
    )  # fmt: skip
    print(f"\n{result.verdict}")
    for note in recording.notes:
        print(f"  - {note}")
