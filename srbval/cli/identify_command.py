"""``srbval identify``: the path to the sensor, from two records or a measured response; or the size of a defect."""

import argparse
import dataclasses
from pathlib import Path

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.cli.data_command import recording_settings
from srbval.cli.output import answer, print_table
from srbval.diagnosis.baseline import load_healthy
from srbval.errors import ConfigurationError
from srbval.path.defect_size import defect_size, size_runs
from srbval.path.identify import BAND_HZ, Identified, identify, identify_response, path_toml, simulated_excitation
from srbval.progress import ProgressDisplay
from srbval.recordings import Recording
from srbval.recordings.frf import read_frf
from srbval.recordings.registry import healthy_baseline, load_registered
from srbval.scene import draws, load_scene, load_sensor_path, merge, rig_inputs
from srbval.storage.files import atomic_write, check_suffix
from srbval.storage.json_files import to_json

COLUMNS = ("mode", "frequency Hz", "u Hz", "damping ratio", "u", "gain", "u", "healthy record differs by, u")
SIZE_COLUMNS = ("from", "extent mm", "from mm", "to mm", "scatter dB")
POWER = 3  # of two: how often inputs are drawn


def run(options: argparse.Namespace) -> int:
    """Identify and print; with -o write the file that `--sensor-path` and a scene's `sensor_path` take."""
    band_hz = (options.band[0], options.band[1]) if options.band else BAND_HZ
    if options.output:
        check_suffix(Path(options.output), "TOML", (".toml",))
    if options.defect_size is not None:
        return _size(options, band_hz)
    if options.mass_kg is not None:
        frequency_hz, values = read_frf(Path(options.file))
        found = identify_response(
            frequency_hz, values, mass_kg=options.mass_kg, name=Path(options.file).name, band_hz=band_hz
        )
    else:
        found = _from_records(options, band_hz)
    if options.output:
        with atomic_write(Path(options.output)) as part:
            part.write_text(path_toml(found.path), encoding="utf-8")
    return answer(options, to_json(found) | {"file": options.output}, lambda: _print(found))


def _from_records(options: argparse.Namespace, band_hz: tuple[float, float]) -> Identified:
    fault, healthy, bearing = _records(options)
    with ProgressDisplay() as progress:
        scene = load_scene(options.scene, {"bearing": bearing})
        excitation = simulated_excitation(fault, scene, progress=progress)
    return identify(fault, healthy, excitation, bearing=load_bearing(bearing), band_hz=band_hz)


def _records(options: argparse.Namespace) -> tuple[Recording, Recording, str]:
    """The faulty and the healthy record, and the bearing's name."""
    settings = recording_settings(options)
    fault = load_registered(options.file, settings)
    if options.defect:
        fault = dataclasses.replace(fault, state=Fault(options.defect))
    if options.healthy:
        healthy = load_healthy(options.healthy, settings, options.healthy_scale)
    else:
        entry = healthy_baseline(fault)
        if entry is None:
            raise ConfigurationError(
                f"{fault.name}: no healthy record of the same rig, speed and load is registered; give --healthy FILE."
            )
        healthy = load_registered(entry.file, settings)
    return fault, healthy, options.bearing or fault.bearing or DEFAULT_BEARING


def _size(options: argparse.Namespace, band_hz: tuple[float, float]) -> int:
    """Print the defect's size with the path to the sensor known."""
    path = load_sensor_path(options.defect_size)
    if path is None or options.output or options.mass_kg is not None:
        raise ConfigurationError(
            "--defect-size reads a path (rig, or a file that srbval identify wrote) and writes none: leave out -o and "
            "--mass-kg."
        )
    fault, healthy, bearing = _records(options)
    own = {"bearing": bearing}
    known = options.scene == "rig" and bearing == DEFAULT_BEARING  # whose inputs have ranges
    with ProgressDisplay() as progress:
        drawn = [load_scene("rig", merge(own, one)) for one in (draws(rig_inputs(), POWER) if known else ())]
        runs = size_runs(fault, load_scene(options.scene, own), drawn, progress=progress)
    found = defect_size(fault, healthy, runs, path, bearing=load_bearing(bearing), band_hz=band_hz)

    def show() -> None:
        low, *_, high = map(_mm, found.simulated_m)
        print(
            f"{fault.name} over {healthy.name}; path {path.source}\nsimulated {low} to {high} mm; {len(drawn)} draws\n"
        )
        rows = [
            (way, _mm(one.extent_m), _mm(one.low_m) if one.low_m else "below",
             _mm(one.high_m) if one.high_m else "above", f"{one.scatter_db:.2g}")
            for way, one in found.sizes.items()
        ]  # fmt: skip
        print_table(SIZE_COLUMNS, rows)
        print(f"\na contact passes from entry to exit in {_mm(found.passage_s)} ms")
        if found.path_is_fitted:
            print("the path was identified from this record with an assumed size, so the level only returns that size")

    document = to_json(found) | {"file": options.file, "healthy": healthy.name, "path": path.source}
    return answer(options, document, show)


def _mm(metres: float) -> str:
    """In thousandths."""
    return f"{1e3 * metres:.3g}"


def _print(found: Identified) -> None:
    table = found.to_dict()
    print(f"{found.path.source}\nband {found.path.low_hz:g} to {found.path.high_hz:g} Hz\n")
    print_table(("modes", "criterion"), [(trial["modes"], trial["criterion"]) for trial in table["trials"]])
    print(f"\ndirect gain {found.path.direct:.4g} ± {table['direct_u']:.2g} (one standard deviation)")
    names = ("frequency_hz", "frequency_u_hz", "damping_ratio", "damping_ratio_u", "gain", "gain_u",
             "healthy_differs_by_u")  # fmt: skip
    print_table(COLUMNS, [(i, *(mode[n] for n in names)) for i, mode in enumerate(table["modes"], start=1)])
    if found.levels_db is not None:
        print(f"\nlevels scatter by {found.path.scatter_db:.2g} dB beyond noise: the error of simulated force and path")
        print("fitted records, which no verdict may use: " + ", ".join(found.path.used))
        print()
        print_table(("Hz", "record dB", "fit dB", "healthy dB"), found.levels_db.round(2).tolist())
