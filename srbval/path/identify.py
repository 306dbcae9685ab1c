"""Identification of the path to the sensor from records of a known fault; equations: theory, "The path to the sensor".

The path has gains from the lowest to the highest third octave in which the power that repeats with the fault exceeds
its standard deviation; missing gains between are interpolated. The sidebands of the measured record and of the
simulated run are compared in the band stated for the record, or else in the frequency range of the gains.
"""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS, Bearing, Fault, load_bearing
from srbval.errors import ConfigurationError, DataError
from srbval.models.run import Run
from srbval.models.sensor import SensorFilter
from srbval.models.simulate import Step, stored_run
from srbval.path.amplitudes import DB_OF_SHARE, SIDEBAND_SPACINGS, WHOLE_HZ, decibels, pattern, third_octaves
from srbval.path.locked import SPACINGS, LockedMean, locked_powers
from srbval.progress import Progress, silent
from srbval.reading.analyse import analyse
from srbval.recordings import Recording, recording_from_run
from srbval.scene import Scene, SensorPath, parts_along_sensor
from srbval.scene.sensor_path import HALF_THIRD_OCTAVE
from srbval.signal import NORMAL_95

DEFAULT_BAND_HZ = WHOLE_HZ  # the drives of the paper's rig have tones near 4 and 8 kHz; below 400 Hz its frame answers
CROSS_RATIO_RANGE = (0.1, 30.0)  # range of cross over load in which the ratio is searched
# Standard deviation of a ratio that may be anywhere in the range.
WIDEST_DB = 20 * math.log10(CROSS_RATIO_RANGE[1] / CROSS_RATIO_RANGE[0]) / math.sqrt(12)
RATIO_STEP = 0.1  # of the logarithm of the ratio, for the slope of the sidebands

NO_POWER_CHANCE = 0.025  # that noise alone is taken for power in any of the bands
ROUNDS = 3  # corrections of the gains for the edges of bands and filters
HIGHEST_SHARE = 0.999  # highest centre of a third octave over the greatest that half the sampling rate permits
Edges = Mapping[float, tuple[float, float]]  # edges of bands [Hz] by their lowest middle [Hz]


@dataclass(frozen=True, kw_only=True, eq=False)
class Identified:
    """Path to the sensor, with the powers and sidebands from which it was identified.

    `bands` has a row for each third octave: the gains of the path and, in dB re 1 m/s2, the power that repeats with the
    fault in the record (NaN if not present) and in the ring's simulated motion along and across the load.
    `sidebands_db` [2, 2] are sidebands relative to the fault line: of the record and of the run with the path (rows),
    one and two shaft frequencies from the line (columns). It is None without a record of an inner-race fault.
    """

    path: SensorPath
    bands: pd.DataFrame
    sidebands_db: FloatArray | None = None

    def to_dict(self) -> dict[str, Any]:
        """Values for JSON; `bands` is a list with one object per third octave."""
        path, bands = self.path, self.bands.to_dict("records")
        found = {"bands": bands, "cross_u_db": path.cross_u_db, "sidebands_db": self.sidebands_db}
        return found | {"band_hz": (path.low_hz, path.high_hz), "used": path.used, "source": path.source}


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Record of a faulty bearing, and a run simulated at its speed, load and fault, its sensor on the outer ring."""

    record: Recording
    run: Run


def identify(
    pair: Pair,
    cross: Pair | None = None,
    *,
    bearing: Bearing | str | Path,
    healthy: Recording | None = None,
    band_hz: tuple[float, float] | None = None,
) -> Identified:
    """Identify the sensor path with which the simulated run of `pair` has the power of its record in each third octave.

    "Power" is the power that repeats with the fault, minus the power of a `healthy` record at the same shaft order. The
    ratio of gains across and along the load is fitted to the sidebands of `cross`, or of `pair` if its fault is on the
    inner race. The default of `band_hz` is `DEFAULT_BAND_HZ`, as far as the sampling rates allow. Raises `DataError`
    for unusable records, `ConfigurationError` for an unknown fault or speed or a band above half a sampling rate.
    """
    bearing = load_bearing(bearing)
    if band_hz is None:
        band_hz = default_band([one for one in (pair.record, recording_from_run(pair.run), healthy) if one])
    bands, powers = record_powers(pair.record, bearing, band_hz, healthy)
    value, u, blocks = np.array([(one.value, one.u, one.blocks) for one in powers.values()]).reshape(-1, 3).T
    if not np.any(value > u * stdtrit(blocks - 1, 1 - NO_POWER_CHANCE / max(value.size, 1))):
        raise DataError(
            f"{pair.record.name}: no third octave between {band_hz[0]:g} and {band_hz[1]:g} Hz has significant power "
            "that repeats with the fault's passages. Widen --band, or use a longer record."
        )
    shown = np.flatnonzero(value > u)
    reach = slice(shown[0], shown[-1] + 1)
    bands = {lowest: bands[lowest] for lowest in list(powers)[reach]}
    power = np.where(value > u, value, np.nan)[reach]
    levels, u_db = 10 * np.log10(power), _interpolate_missing(DB_OF_SHARE * u[reach] / power)
    order = line_order(pair.run, bearing)
    parts = parts_along_sensor(pair.run.acceleration_m_s2, pair.run.scene.load.direction_rad).T
    of_parts = [recording_from_run(replace(pair.run, sensor_m_s2=np.ascontiguousarray(part))) for part in parts]
    ring = np.array([locked_db(one, bearing, bands, order) for one in of_parts])
    low_hz, high_hz = next(iter(bands.values()))[0], list(bands.values())[-1][1]
    middles = [one for one in third_octaves(band_hz) if low_hz < one < high_hz]
    place = np.searchsorted(list(bands), middles, side="right") - 1  # of each third octave among the bands
    inner_race = cross or (pair if pair.record.state is Fault.INNER else None)
    used = (pair.record.name, *((f"{inner_race.record.name} (direction)",) if inner_race else ()))
    source = f"identified from {' and '.join(used)}, driven by {recording_from_run(pair.run).name}"

    def path_of(gain: FloatArray, ratio: float) -> SensorPath:
        load, across, u = (tuple(each[place].tolist()) for each in (gain, ratio * gain, u_db))
        return SensorPath(frequency_hz=tuple(middles), load=load, cross=across, u_db=u, used=used, source=source)

    def gains(ratio: float) -> FloatArray:
        excited = 10 ** (ring[0] / 10) + ratio**2 * 10 ** (ring[1] / 10)
        return 10 ** (_interpolate_missing(levels - 10 * np.log10(excited)) / 20)

    ratio, cross_u_db, sidebands = 1.0, 0.0, None
    if inner_race:
        ratio, cross_u_db, sidebands = _fit_cross_ratio(inner_race, bearing, lambda tried: path_of(gains(tried), tried))
    gain = gains(ratio)
    for _ in range(ROUNDS):
        shown_db = locked_db(record_behind_path(pair.run, path_of(gain, ratio)), bearing, bands, order)
        gain = gain * 10 ** (_interpolate_missing(levels - shown_db) / 20)
    scatter = float(np.std(20 * np.log10(gain), ddof=min(1, gain.size - 1)))
    u_db = np.hypot(u_db, scatter * (np.bincount(place) > 1))
    path = replace(path_of(gain, ratio), cross_u_db=cross_u_db)
    table = {name: getattr(path, name) for name in ("frequency_hz", "load", "cross", "u_db")}
    table |= {"record_db": levels[place], "ring_load_db": ring[0, place], "ring_cross_db": ring[1, place]}
    return Identified(path=path, bands=pd.DataFrame(table), sidebands_db=sidebands)


def default_band(records: list[Recording]) -> tuple[float, float]:
    """Band in which models were compared with measurements, as far as it is below half the records' sampling rates."""
    low, high = DEFAULT_BAND_HZ
    return low, min(high, HIGHEST_SHARE * min(one.fs_hz for one in records) / 2 / HALF_THIRD_OCTAVE)


def line_order(run: Run, bearing: Bearing) -> float:
    """Shaft order of a run's fault line: computed from its cage speed, or read from its signal for a roller fault."""
    by_cage = run.scene.defect.kind.passing_order(bearing.rolling_elements, run.cage_ratio)
    return by_cage or found_order(recording_from_run(run), bearing, DEFAULT_BAND_HZ)


def found_order(record: Recording, bearing: Bearing, band_hz: tuple[float, float]) -> float:
    """Shaft order of a record's fault line as read in a band; its kinematic order if the line cannot be read."""
    state, shaft_hz = _fault_and_speed(record)
    line = analyse(record, bearing=bearing, band_hz=band_hz).line_of(state)
    return (line.found_hz or line.kinematic_hz) / shaft_hz


def _fault_and_speed(record: Recording) -> tuple[Fault, float]:
    """Fault and shaft speed [Hz] of a record; `ConfigurationError` if either is unknown."""
    if record.state not in DEFECTS or record.speed is None:
        raise ConfigurationError(
            f"{record.name}: state {record.state or 'unknown'}, speed {'known' if record.speed else 'unknown'}: a path "
            "is identified from a record of a known fault at a known speed; give --defect and --rpm."
        )
    return record.state, record.speed.value_hz


def record_behind_path(run: Run, path: SensorPath | None) -> Recording:
    """Recording of a run by a sensor at the end of a path from the outer ring, or on the ring if `path` is None."""
    sensor = SensorFilter(path, run.scene.output_rate_hz, run.scene.load.direction_rad)
    return recording_from_run(replace(run, sensor_m_s2=sensor.add(run.acceleration_m_s2)))


def join_bands(bands: Edges, least_hz: float) -> dict[float, tuple[float, float]]:
    """Join neighbouring third octaves, from the highest down, to bands at least `least_hz` wide; drop any remainder."""
    found, top_hz = dict[float, tuple[float, float]](), math.nan
    for middle, (low, high) in sorted(bands.items(), reverse=True):
        top_hz = high if math.isnan(top_hz) else top_hz
        if top_hz - low >= least_hz:
            found[middle], top_hz = (low, top_hz), math.nan
    return dict(sorted(found.items()))


def record_powers(
    record: Recording, bearing: Bearing, band_hz: tuple[float, float], healthy: Recording | None = None
) -> tuple[Edges, dict[float, LockedMean]]:
    """Edges of bands, and the power in each that repeats with the fault, minus the power of a `healthy` record.

    A band joins one or more neighbouring third octaves; its key is their lowest centre frequency [Hz].
    """
    for one in (record, *([healthy] if healthy else ())):
        if one.unit != "m/s2":
            raise DataError(f"{one.name}: samples in {one.unit!r}; m/s2 is needed. State --unit (and --scale).")
    limit_hz, bands = 0.5 * record.fs_hz / HALF_THIRD_OCTAVE, third_octaves(band_hz)
    if not bands or max(bands) >= limit_hz:
        raise ConfigurationError(
            f"band {band_hz[0]:g} to {band_hz[1]:g} Hz: it must contain the centre frequency of a third octave and end "
            f"below {limit_hz:.0f} Hz, because of the sampling rate of {record.name}."
        )
    order = found_order(record, bearing, band_hz)
    bands = join_bands(bands, SPACINGS * order * _fault_and_speed(record)[1])
    found = locked_powers(record, bearing, order, bands)
    other = {} if healthy is None else locked_powers(healthy, bearing, order, bands)
    for lowest, less in other.items():
        own = found[lowest]
        found[lowest] = replace(own, value=own.value - less.value, u=math.hypot(own.u, less.u))
    return bands, found


def locked_db(run: Recording, bearing: Bearing, bands: Edges, order: float) -> FloatArray:
    """Level [dB re 1 m/s2] in each band of the power that repeats `order` times per turn in a simulated record."""
    if max(high for _, high in bands.values()) >= 0.5 * run.fs_hz:
        raise ConfigurationError(
            f"output_rate_hz = {run.fs_hz:g} of the scene is too low for third octaves up to {max(bands):.0f} Hz; "
            "raise output_rate, or lower the upper edge of --band."
        )
    return np.array([decibels(one.value) for one in locked_powers(run, bearing, order, bands).values()])


def _interpolate_missing(values: FloatArray) -> FloatArray:
    """Interpolate missing values linearly; the first and the last value must be known."""
    known = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(values.size), known, values[known])


def _fit_cross_ratio(
    pair: Pair, bearing: Bearing, path_with: Callable[[float], SensorPath]
) -> tuple[float, float, FloatArray]:
    """Fit the ratio of the path's gains across and along the load to the sidebands of an inner-race fault.

    `path_with` makes the path with a given ratio. Returns the ratio, its standard error [dB], and the levels [dB] of
    the sidebands of record and run (rows), one and two shaft frequencies from the line (columns).
    """
    from scipy.optimize import minimize_scalar

    any_path = path_with(1.0)
    band_hz = pair.record.band_hz or (any_path.low_hz, any_path.high_hz)

    def sidebands(record: Recording, order: float) -> FloatArray:
        read = pattern(record, bearing, Fault.INNER, order, band_hz)
        found = [read[f"sidebands {n}"] for n in SIDEBAND_SPACINGS]
        return np.array([(one.value, one.ci95 / NORMAL_95, one.present) for one in found]).T

    wanted, u, present = sidebands(pair.record, found_order(pair.record, bearing, band_hz))
    if pair.record.state is not Fault.INNER or not present.all():
        raise DataError(
            f"{pair.record.name}: the ratio of the path's gains across and along the load follows from the sidebands "
            "of an inner-race fault, which are not detected here. Use another record for --cross-from."
        )
    run_order = line_order(pair.run, bearing)

    def behind_ratio(log_ratio: float) -> FloatArray:
        return sidebands(record_behind_path(pair.run, path_with(math.exp(log_ratio))), run_order)[0]

    def misfit(log_ratio: float) -> float:
        return float(np.sum(((behind_ratio(log_ratio) - wanted) / u) ** 2))

    best = minimize_scalar(misfit, bounds=np.log(CROSS_RATIO_RANGE), method="bounded", options={"xatol": 0.01}).x
    slope = (behind_ratio(best + RATIO_STEP) - behind_ratio(best - RATIO_STEP)) / (2 * RATIO_STEP)
    least = 2 * DB_OF_SHARE / WIDEST_DB  # sidebands may hardly move
    u_db = 2 * DB_OF_SHARE / max(math.sqrt(float(np.sum((slope / u) ** 2))), least)
    return math.exp(best), u_db, np.array([wanted, behind_ratio(best)])


def simulated_run(record: Recording, scene: Scene, *, progress: Progress = silent) -> Run:
    """Simulate a scene, its sensor on the outer ring, with the speed, load, fault and length of a record."""
    (state, shaft_hz), load = _fault_and_speed(record), scene.load
    if record.radial_n is not None:
        load = replace(load, radial_n=record.radial_n, axial_n=record.axial_n or 0.0)
    steady = replace(scene, load=load, speed_profile=None, load_profile=None, sensor_path=None)
    speed_rad_s, defect = 2 * math.pi * shaft_hz, replace(scene.defect, kind=state)
    own = replace(steady, shaft_speed_rad_s=speed_rad_s, defect=defect, duration_s=round(record.seconds, 2))
    return stored_run(own, step=Step.UNCHECKED, progress=progress).require_usable("the run that drives the path")


def path_toml(path: SensorPath) -> str:
    """Text of a TOML file with the gains of a path; the setting `sensor_path` of a scene names such a file."""
    gains = {name: getattr(path, name) for name in ("frequency_hz", "load", "cross", "u_db")}
    table: dict[str, Any] = {name: [float(f"{x:.6g}") for x in values] for name, values in gains.items() if values}
    table |= {"cross_u_db": float(f"{path.cross_u_db:.4g}"), "source": path.source, "used": path.used}
    lines = [
        f"# {path.source}",
        "# Gains of force times path; the records named in `used` are fitted: no verdict rests on them.",
        *(f"{name} = {json.dumps(value, ensure_ascii=False)}" for name, value in table.items()),  # valid in TOML too
    ]
    return "".join("".join(c if c.isprintable() else "?" for c in line) + "\n" for line in lines)
