"""``srbval identify``: the path from the outer ring to the sensor, from two records or a measured response."""

import argparse
import dataclasses
from pathlib import Path

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.cli.data_command import recording_settings
from srbval.cli.output import print_json, print_table
from srbval.errors import ConfigurationError
from srbval.progress import ProgressDisplay
from srbval.recordings.frf import read_frf
from srbval.recordings.registry import healthy_baseline, load_registered
from srbval.scene import load_scene
from srbval.storage.strict_json import json_object
from srbval.storage.whole_file import whole_file
from srbval.validation.identify import (
    BAND_HZ,
    Identified,
    identify,
    identify_response,
    path_toml,
    simulated_excitation,
)

COLUMNS = ("mode", "frequency Hz", "u Hz", "damping ratio", "u", "gain", "u", "healthy record differs by, u")


def run(options: argparse.Namespace) -> int:
    """Identify and print; with -o write the file that `--sensor-path` and a scene's `sensor_path` take."""
    band_hz = (options.band[0], options.band[1]) if options.band else BAND_HZ
    if options.mass_kg is not None:
        frequency_hz, values = read_frf(Path(options.file))
        found = identify_response(
            frequency_hz, values, mass_kg=options.mass_kg, name=Path(options.file).name, band_hz=band_hz
        )
    else:
        found = _from_records(options, band_hz)
    if options.output:
        with whole_file(Path(options.output)) as part:
            part.write_text(path_toml(found.path), encoding="utf-8")
    if options.json:
        print_json(json_object(found) | {"file": options.output})
    else:
        _print(found)
    return 0


def _from_records(options: argparse.Namespace, band_hz: tuple[float, float]) -> Identified:
    settings = recording_settings(options)
    fault = load_registered(options.file, settings)
    if options.defect:
        fault = dataclasses.replace(fault, state=Fault(options.defect))
    if options.healthy:
        healthy = load_registered(options.healthy, settings)
    else:
        entry = healthy_baseline(fault)
        if entry is None:
            raise ConfigurationError(
                f"{fault.name}: no healthy record of the same rig, speed and load is registered; give --healthy FILE."
            )
        healthy = load_registered(entry.file, settings)
    bearing = options.bearing or fault.bearing or DEFAULT_BEARING
    with ProgressDisplay() as progress:
        scene = load_scene(options.scene, {"bearing": bearing})
        excitation = simulated_excitation(fault, scene, progress=progress)
    return identify(fault, healthy, excitation, bearing=load_bearing(bearing), band_hz=band_hz)


def _print(found: Identified) -> None:
    table = found.to_dict()
    print(f"{found.path.source}\nband {found.path.low_hz:g} to {found.path.high_hz:g} Hz\n")
    print_table(("modes", "BIC"), [(trial["modes"], trial["bic"]) for trial in table["trials"]])
    print(f"\ndirect gain {found.path.direct:.4g} ± {table['direct_u']:.2g} (one standard deviation)")
    names = ("frequency_hz", "frequency_u_hz", "damping_ratio", "damping_ratio_u", "gain", "gain_u",
             "healthy_differs_by_u")  # fmt: skip
    print_table(COLUMNS, [(i, *(mode[n] for n in names)) for i, mode in enumerate(table["modes"], start=1)])
    if found.levels_db is not None:
        print(f"\nlevels scatter by {found.path.scatter_db:.2g} dB beyond noise: what simulated force and path miss")
        print("fitted records, on which no verdict may rest: " + ", ".join(found.path.used))
        print()
        print_table(("Hz", "record dB", "fit dB", "healthy dB"), found.levels_db.round(2).tolist())
