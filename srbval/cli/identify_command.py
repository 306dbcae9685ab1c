"""``srbval identify``: the path to the sensor, from two records or a measured response; or the size of a defect."""

import argparse
import dataclasses
from pathlib import Path

from srbval.bearing import DEFAULT_BEARING, Fault, check_orders_are_known, load_bearing
from srbval.cli.data_command import recording_settings
from srbval.cli.output import answer, print_table
from srbval.diagnosis.baseline import load_healthy
from srbval.errors import ConfigurationError
from srbval.path.defect_size import defect_size, size_runs
from srbval.path.identify import BAND_HZ, Identified, Pair, identify, identify_response, path_toml, simulated_run
from srbval.progress import progress_display
from srbval.recordings import Recording
from srbval.recordings.load import read_frf
from srbval.recordings.registry import load_registered
from srbval.scene import draws, load_scene, load_sensor_path, merge, rig_inputs
from srbval.storage.files import atomic_write, check_suffix
from srbval.storage.json_files import to_json

DIGITS = (0, 2, 2, 1, 1, 1, 1)  # behind the point
COLUMNS = ("Hz", "gain along the load", "across it", "u dB", "record dB", "ring dB", "ring, across dB")
SIZE_COLUMNS = ("from", "extent mm", "from mm", "to mm")
POWER = 4  # of two: how often inputs are drawn


def run(options: argparse.Namespace) -> int:
    """Identify and print; with -o write the file that `--sensor-path` and a scene's `sensor_path` take."""
    band_hz = (options.band[0], options.band[1]) if options.band else BAND_HZ
    if options.output:
        check_suffix(Path(options.output), "TOML", (".toml",))
    if options.defect_size is not None:
        return _size(options, band_hz)
    found = _from_responses(options, band_hz) if options.mass_kg is not None else _from_records(options, band_hz)
    if options.output:
        with atomic_write(Path(options.output)) as part:
            part.write_text(path_toml(found.path), encoding="utf-8")
    return answer(options, to_json(found) | {"file": options.output}, lambda: _print(found))


def _from_responses(options: argparse.Namespace, band_hz: tuple[float, float]) -> Identified:
    frequency_hz, values = read_frf(Path(options.file))
    cross = read_frf(Path(options.cross_from)) if options.cross_from else None
    return identify_response(
        frequency_hz, values, cross=cross, mass_kg=options.mass_kg, name=Path(options.file).name, band_hz=band_hz
    )


def _from_records(options: argparse.Namespace, band_hz: tuple[float, float]) -> Identified:
    fault, healthy, bearing = _records(options, options.file)
    records = [fault, *([_records(options, options.cross_from)[0]] if options.cross_from else ())]
    with progress_display() as progress:
        scene = load_scene(options.scene, {"bearing": bearing})
        pairs = [Pair(record=one, run=simulated_run(one, scene, progress=progress)) for one in records]
    return identify(*pairs, bearing=bearing, healthy=healthy, band_hz=band_hz)


def _records(options: argparse.Namespace, file: str) -> tuple[Recording, Recording | None, str]:
    """The faulty record, the healthy one if it is given, and the bearing's name."""
    settings = recording_settings(options)
    fault = load_registered(file, settings)
    if file == options.cross_from:
        fault = dataclasses.replace(fault, state=Fault.INNER)
    elif options.defect:
        fault = dataclasses.replace(fault, state=Fault(options.defect))
    healthy = load_healthy(options.healthy, settings, options.healthy_scale) if options.healthy else None
    bearing = options.bearing or fault.bearing or DEFAULT_BEARING
    check_orders_are_known(load_bearing(bearing))
    return fault, healthy, bearing


def _size(options: argparse.Namespace, band_hz: tuple[float, float]) -> int:
    """Print the defect's size with the path to the sensor known."""
    path = load_sensor_path(options.defect_size)
    if path is None or options.output or options.cross_from or options.mass_kg is not None:
        raise ConfigurationError(
            "--defect-size reads a path (rig, or a file that srbval identify wrote) and writes none: leave out -o, "
            "--cross-from and --mass-kg."
        )
    fault, healthy, bearing = _records(options, options.file)
    own = {"bearing": bearing}
    known = options.scene == "rig" and bearing == DEFAULT_BEARING  # whose inputs have ranges
    inputs = (*rig_inputs(), *rig_inputs("position")) if known else ()
    with progress_display() as progress:
        drawn = [load_scene("rig", merge(own, one)) for one in (draws(inputs, POWER) if known else ())]
        runs = size_runs(fault, load_scene(options.scene, own), drawn, progress=progress)
    found = defect_size(
        fault, runs, path, bearing=load_bearing(bearing), healthy=healthy, band_hz=band_hz if options.band else None
    )

    def show() -> None:
        low, *_, high = map(_mm, found.simulated_m)
        print(f"{fault.name}; path {path.source}\nsimulated {low} to {high} mm; {len(drawn)} draws\n")
        rows = [
            (way, _mm(one.extent_m), _mm(one.low_m) if one.low_m else "below",
             _mm(one.high_m) if one.high_m else "above")
            for way, one in found.sizes.items()
        ]  # fmt: skip
        print_table(SIZE_COLUMNS, rows)
        print(f"\na contact passes from entry to exit in {_mm(found.passage_s)} ms")
        if found.path_is_fitted:
            print("the path was identified from this record with an assumed size, so the level only returns that size")

    document = to_json(found) | {"file": options.file, "healthy": healthy and healthy.name, "path": path.source}
    return answer(options, document, show)


def _mm(metres: float) -> str:
    """In thousandths."""
    return f"{1e3 * metres:.3g}"


def _print(found: Identified) -> None:
    bands = found.to_dict()["bands"]
    print(f"{found.path.source}\nband {found.path.low_hz:.0f} to {found.path.high_hz:.0f} Hz\n")
    print_table(
        COLUMNS, [[f"{x:.{digits}f}" for x, digits in zip(band.values(), DIGITS, strict=True)] for band in bands]
    )
    if found.sidebands_db is not None:
        record, run = (" and ".join(f"{one:.1f}" for one in row) for row in found.sidebands_db.tolist())
        print(f"\ncross over load {bands[0]['cross'] / bands[0]['load']:.3g}, known to {found.path.cross_u_db:.2g} dB: "
              f"sidebands at {record} dB, with it {run} dB")  # fmt: skip
    if found.path.used:
        print("\nfitted records, which no verdict may use: " + ", ".join(found.path.used))
    gains = [band["load"] for band in bands]
    print(f"From ring to sensor, along the load, the path multiplies by {min(gains):.2g} to {max(gains):.2g}.")
