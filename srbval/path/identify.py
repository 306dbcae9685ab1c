"""Identifying the path to the sensor: from a healthy and a faulty record, or from a measured response.

The faulty record's powers are taken in bands as wide as its line, or a multiple, each about a harmonic: a fault that
repeats says of the path what its harmonics show. What excites is simulated at the record's own speed and load, without
a path. The healthy record, whose excitation is not known, is fitted by itself with as many modes and a power of the
frequency as excitation: where it puts a mode elsewhere the mode is that much less sure.
"""

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS, Bearing, load_bearing
from srbval.errors import ConfigurationError, DataError, NumericsError
from srbval.models.run_store import stored_run
from srbval.models.simulate import Step
from srbval.path.amplitudes import SEGMENT_S, record_density
from srbval.path.path_fit import LEAST_SPARE, BandPowers, MeasuredResponse, PathFit, best_of, fit_path, inflated, refit
from srbval.progress import Progress, silent
from srbval.recordings import Recording, recording_from_run
from srbval.scene import Scene, SensorPath

# Drives tone near 4 and 8 kHz on the paper's rig, whatever the speed; below 400 Hz its frame answers.
BAND_HZ = (400.0, 3150.0)
MOST_BANDS = 30


@dataclass(frozen=True, kw_only=True, eq=False)
class Identified:
    """A path and what it rests on.

    `trials` are the fits by their number of modes; `healthy_ratios` by how many of their own u the healthy record's
    frequencies differ, one a mode, empty where there is none; `levels_db` of each band [n, 4]: its middle [Hz], record,
    fit and healthy record [dB re 1 m/s2], None for a measured response. `chance` of so bad a fit by noise alone.
    """

    path: SensorPath
    trials: tuple[PathFit, ...]
    healthy_ratios: tuple[float, ...] = ()
    levels_db: FloatArray | None = None
    chance: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values: deviations are relative but for gains."""
        u = self.path.deviations().tolist()
        return {
            "direct": self.path.direct,
            "direct_u": self.path.direct * u[0],
            "modes": [
                vars(mode)
                | {
                    "frequency_u_hz": mode.frequency_hz * u[1 + 3 * i],
                    "damping_ratio_u": mode.damping_ratio * u[2 + 3 * i],
                    "gain_u": u[3 + 3 * i],
                    "healthy_differs_by_u": self.healthy_ratios[i] if self.healthy_ratios else None,
                }
                for i, mode in enumerate(self.path.modes)
            ],
            "scatter_db": self.path.scatter_db,
            "band_hz": (self.path.low_hz, self.path.high_hz),
            "trials": [{"modes": fit.modes, "criterion": fit.criterion} for fit in self.trials],
            "chance": self.chance,
            "used": self.path.used,
            "source": self.path.source,
            "levels_db": self.levels_db,
        }


def identify(
    fault: Recording, healthy: Recording, excitation: Recording, *, bearing: Bearing | str | Path,
    band_hz: tuple[float, float] = BAND_HZ,
) -> Identified:  # fmt: skip
    """The path that makes the `excitation`, a simulated run at the record's speed, into the fault's record.

    Raises `DataError` for records that cannot be compared (unit, no speed, too few bands), `ConfigurationError` for a
    band that lies beyond a record, or a record without a fault.
    """
    data = band_powers(fault, healthy, excitation, bearing=load_bearing(bearing), band_hz=band_hz)
    fits = fit_path(data)
    if not fits:
        raise DataError(
            f"{data.size} bands between {band_hz[0]:g} and {band_hz[1]:g} Hz are too few for a path: "
            f"{2 + len(data.extras) + LEAST_SPARE} or more are needed. Widen --band."
        )
    silent_powers = replace(
        data, fault=data.healthy, healthy=np.zeros(data.size), coloured=True,
        excitation=np.full_like(data.excitation, 1 / data.excitation.shape[1]),
    )  # fmt: skip
    best, ratios = inflated(best_of(fits), refit(silent_powers, best_of(fits)))
    used = tuple(record.name for record in (healthy, fault))
    source = f"identified from {used[1]} over {used[0]}, driven by {excitation.name}"
    path = best.path(data, source=source, used=used)
    whole = data.powers(best.parameters) + data.healthy
    levels = [10 * np.log10(power) for power in (data.fault, whole, data.healthy)]
    return Identified(
        path=path, trials=fits, healthy_ratios=tuple(ratios), chance=data.chance(path),
        levels_db=np.column_stack((data.frequency_hz.mean(axis=1), *levels)),
    )  # fmt: skip


def identify_response(
    frequency_hz: FloatArray,
    values: NDArray[np.complex128],
    *,
    mass_kg: float,
    name: str,
    band_hz: tuple[float, float] = BAND_HZ,
) -> Identified:
    """The path of a measured response [m/s2/N] of the structure that is `mass_kg` of ring and housing in the scene."""
    inside = (frequency_hz >= band_hz[0]) & (frequency_hz <= band_hz[1])
    data = MeasuredResponse(band_hz=band_hz, frequency_hz=frequency_hz[inside], values=mass_kg * values[inside])
    if data.size < 2 * MOST_BANDS or not data.scale:
        raise DataError(
            f"{name}: {data.size // 2} lines between {band_hz[0]:g} and {band_hz[1]:g} Hz, at least {MOST_BANDS} "
            "that are not zero are needed. Widen --band or measure finer."
        )
    fits = fit_path(data)
    path = best_of(fits).path(data, source=f"measured response {name}, {mass_kg:g} kg of ring and housing")
    return Identified(path=path, trials=fits)


def band_powers(
    fault: Recording, healthy: Recording, excitation: Recording, *, bearing: Bearing, band_hz: tuple[float, float]
) -> BandPowers:
    """Powers of three records in bands about the fault's harmonics [(m/s2)^2]."""
    if fault.state not in DEFECTS or fault.speed is None:
        raise ConfigurationError(
            f"{fault.name}: state {fault.state or 'unknown'}, speed {'known' if fault.speed else 'unknown'}: a path is "
            "identified from a record of a known fault at a known speed; give --defect and --rpm."
        )
    line_hz = fault.speed.value_hz * fault.state.line_order(bearing.orders)
    for record in (fault, healthy, excitation):
        if record.unit != "m/s2":
            raise DataError(f"{record.name}: samples in {record.unit!r}; m/s2 is needed. State --unit, or --scale too.")
        if not 0 < band_hz[0] < band_hz[1] < 0.5 * record.fs_hz:
            raise ConfigurationError(
                f"band {band_hz[0]:g} to {band_hz[1]:g} Hz must rise and lie within 0 and {record.fs_hz / 2:g} Hz, "
                f"half the rate of {record.name}."
            )
        if record.samples < 4 * round(SEGMENT_S * record.fs_hz):
            raise DataError(f"{record.name}: {record.seconds:.3g} s; a path needs at least {4 * SEGMENT_S:g} s.")
    width = line_hz * max(1, round((band_hz[1] - band_hz[0]) / (MOST_BANDS * line_hz)))
    middles = np.arange(math.ceil(band_hz[0] / width + 0.5), math.floor(band_hz[1] / width - 0.5) + 1) * width
    grid = np.arange(round(width * SEGMENT_S)) / round(width * SEGMENT_S) - 0.5
    frequency_hz = middles[:, None] + (grid + 0.5 / grid.size) * width
    power = [
        np.interp(frequency_hz, *record_density(record)) * width / grid.size for record in (fault, healthy, excitation)
    ]
    return BandPowers(
        band_hz=band_hz, frequency_hz=frequency_hz, excitation=power[2], fault=power[0].sum(axis=1),
        healthy=power[1].sum(axis=1), freedom=width * min(fault.seconds, healthy.seconds),
    )  # fmt: skip


def simulated_excitation(
    fault: Recording, scene: Scene, *, longest_s: float = math.inf, progress: Progress = silent
) -> Recording:
    """A run of the scene at the record's speed, load and state, without a path, as long as the record or `longest_s`.

    Raises `NumericsError` where it fails, `ConfigurationError` for a record without a fault or speed.
    """
    if fault.state not in DEFECTS or fault.speed is None:
        raise ConfigurationError(f"{fault.name}: its fault and its speed must be known; give --defect and --rpm.")
    load = scene.load
    if fault.radial_n is not None:
        load = replace(load, radial_n=fault.radial_n, axial_n=fault.axial_n or 0.0)
    own = replace(
        scene, shaft_speed_rad_s=2 * math.pi * fault.speed.value_hz, load=load, speed_profile=None, load_profile=None,
        defect=replace(scene.defect, kind=fault.state), duration_s=round(min(fault.seconds, longest_s), 2),
        sensor_path=None,
    )  # fmt: skip
    run = stored_run(own, step=Step.UNCHECKED, progress=progress)
    if not run.status.usable:
        raise NumericsError(f"the run that drives the path failed ({run.status}): {run.reason}.")
    return recording_from_run(run)


def path_toml(path: SensorPath) -> str:
    """The path as the file that a scene's `sensor_path` names."""

    def quoted(text: str) -> str:  # a TOML string of printable text; the escapes are JSON's
        return json.dumps("".join(c if c.isprintable() else "?" for c in text), ensure_ascii=False)

    numbers = {name: getattr(path, name) for name in ("direct", "low_hz", "high_hz")}
    lines = [
        f"# {path.source}",
        "# Gains of force times path; the records named in `used` are fitted: no verdict rests on them.",
        *(f"{name} = {value:.6g}" for name, value in numbers.items()),
        f"scatter_db = {path.scatter_db:.4g}",
        f"source = {quoted(path.source)}",
        f"used = [{', '.join(quoted(name) for name in path.used)}]",
        "covariance = [  # of ln direct and, mode by mode, ln frequency, ln damping_ratio, gain",
        *("  [" + ", ".join(f"{value:.12g}" for value in row) + "]," for row in path.covariance),
        "]",
    ]
    for mode in path.modes:
        lines += ["", "[[modes]]", *(f"{name} = {value:.6g}" for name, value in vars(mode).items())]
    return "\n".join(lines) + "\n"
