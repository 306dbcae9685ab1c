"""Command ``srbval identify``: identify the vibration path from outer ring to sensor from records of a known fault."""

import argparse
import dataclasses
from pathlib import Path

from srbval.bearing import DEFAULT_BEARING, Fault
from srbval.cli.data_command import recording_settings
from srbval.cli.output import print_result, print_table, write_text
from srbval.diagnosis.baseline import load_healthy
from srbval.path.identify import Identified, Pair, identify, path_toml, simulated_run
from srbval.progress import ProgressDisplay
from srbval.recordings.registry import load_registered
from srbval.scene import load_scene
from srbval.storage.files import check_suffix
from srbval.storage.json_files import to_json

PATH_COLUMNS = {
    "frequency_hz": ("Hz", ".0f"),
    "load": ("gain along the load", ".2f"),
    "cross": ("across it", ".2f"),
    "u_db": ("u dB", ".1f"),
    "record_db": ("record dB", ".1f"),
    "ring_load_db": ("ring dB", ".1f"),
    "ring_cross_db": ("ring, across dB", ".1f"),
}


def run_identify_command(options: argparse.Namespace) -> int:
    """Identify the transfer path to the sensor, print it and, with ``-o``, write it to a file for ``--sensor-path``."""
    if options.output:
        check_suffix(Path(options.output), "TOML", (".toml",))
    settings = recording_settings(options)
    fault = load_registered(options.file, settings)
    records = [dataclasses.replace(fault, state=Fault(options.defect)) if options.defect else fault]
    if options.cross_from:
        records.append(dataclasses.replace(load_registered(options.cross_from, settings), state=Fault.INNER))
    healthy = load_healthy(options.healthy, settings, options.healthy_scale) if options.healthy else None
    bearing = options.bearing or fault.bearing or DEFAULT_BEARING
    with ProgressDisplay() as progress:
        scene = load_scene(options.scene, {"bearing": bearing})
        pairs = [Pair(record=one, run=simulated_run(one, scene, progress=progress)) for one in records]
    found = identify(*pairs, bearing=bearing, healthy=healthy, band_hz=tuple(options.band) if options.band else None)
    if options.output:
        write_text(Path(options.output), path_toml(found.path))
    return print_result(options, to_json(found) | {"file": options.output}, lambda: _print(found))


def _print(found: Identified) -> None:
    path, bands = found.path, found.to_dict()["bands"]
    print(f"{path.source}\nband {path.low_hz:.0f} to {path.high_hz:.0f} Hz: {found.band_why}\n")
    rows = [[f"{band[name]:{spec}}" for name, (_, spec) in PATH_COLUMNS.items()] for band in bands]
    print_table([title for title, _ in PATH_COLUMNS.values()], rows)
    if found.sidebands_db is not None:
        record, run = (" and ".join(f"{one:.1f}" for one in row) for row in found.sidebands_db.tolist())
        print(
            f"\ngain across the load over gain along it: {path.cross[0] / path.load[0]:.3g}, known to "
            f"{path.cross_u_db:.2g} dB; sidebands of the record {record} dB, of the run behind the path {run} dB"
        )
    print("\nfitted records, which no verdict may use: " + ", ".join(path.used))
    print(f"From ring to sensor, along the load, the path multiplies by {min(path.load):.2g} to {max(path.load):.2g}.")
