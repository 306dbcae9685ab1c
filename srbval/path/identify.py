"""Identifying the path to the sensor: from records of a known fault, or from measured responses.

In each third octave the power locked to the fault (`srbval.reading.locked`) of the record is what the path makes of
that of a run of the model at the record's own speed and load, with X_l and X_c of its parts along the load and across:

    D = g^2 (X_l + r^2 X_c)

The ratio r of cross to load is the same in all bands. A hole that turns with the inner race strikes along the load and
across it by turns, so that its sidebands tell r: it is the one for which the run behind the path shows the sidebands of
the record, in the band in which its data set is demodulated, or else in that of the path. A record of a fault that
stands still tells none, and without another one r is 1.

A third octave that does not hold two spacings of the fault's line is joined with those below it until they do, and they
have one gain, which may miss each of theirs by as much as gains scatter from band to band. Gains reach from the lowest
to the highest band in which the record's power is above its own standard deviation; a band between in which it is not
has its neighbours' gain.
"""

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from srbval.arrays import ComplexArray, FloatArray
from srbval.bearing import DEFECTS, Bearing, Fault, load_bearing
from srbval.errors import ConfigurationError, DataError
from srbval.models.run import Run
from srbval.models.sensor import SensorFilter
from srbval.models.simulate import Step, stored_run
from srbval.path.amplitudes import DB, SIDEBANDS, pattern
from srbval.progress import Progress, silent
from srbval.reading.analyse import analyse
from srbval.reading.locked import SPACINGS, locked_powers
from srbval.recordings import Recording, recording_from_run
from srbval.scene import Scene, SensorPath, parts_along_sensor
from srbval.scene.sensor_path import HALF_THIRD_OCTAVE
from srbval.signal.locked import LockedMean

# Drives tone near 4 and 8 kHz on the paper's rig, whatever the speed; below 400 Hz its frame answers.
BAND_HZ = (400.0, 3150.0)
RATIOS = (0.1, 30.0)  # of cross to load, between which one is looked for
WIDEST_DB = 20 * math.log10(RATIOS[1] / RATIOS[0]) / math.sqrt(12)  # deviation of one that may lie anywhere between
CHANCE = 0.025  # that noise alone shows power in any of the bands
ROUNDS = 3  # of setting gains so that the run behind them has the record's power, edges of bands and filters included
LEAST_LINES = 3  # of a measured response in a band


@dataclass(frozen=True, kw_only=True, eq=False)
class Identified:
    """A path and what it rests on.

    `record_db`: power of the record locked to its fault in each of the path's bands [dB re 1 m/s2], NaN where it is not
    shown, and `ring_db` that of the run, along the load and across it [2, n]; of joined bands, what all of them have;
    empty for a measured response.
    `sidebands_db`: of record and run behind the path, at one and two times their spacing [2, 2]; None where no
    sidebands tell the ratio.
    """

    path: SensorPath
    record_db: FloatArray
    ring_db: FloatArray
    sidebands_db: FloatArray | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values, one table of all bands."""
        path, count = self.path, len(self.path.load)
        known = np.vstack((self.record_db, self.ring_db)) if self.record_db.size else np.full((3, count), np.nan)
        columns = zip(path.frequency_hz, path.load, path.cross, path.u_db or [math.nan] * count, *known, strict=True)
        names = ("frequency_hz", "load", "cross", "u_db", "record_db", "ring_load_db", "ring_cross_db")
        return {
            "bands": [dict(zip(names, row, strict=True)) for row in columns],
            "cross_u_db": path.cross_u_db, "sidebands_db": self.sidebands_db, "band_hz": (path.low_hz, path.high_hz),
            "used": path.used, "source": path.source,
        }  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Pair:
    """A record of a faulty bearing and the run of a scene at its speed, load and fault, without a path."""

    record: Recording
    run: Run


def third_octaves(band_hz: tuple[float, float]) -> dict[float, tuple[float, float]]:
    """Edges of the third octaves whose middles lie in a band, by these middles [Hz]."""
    first, last = (10 * math.log10(one) for one in band_hz)
    middles = [10 ** (n / 10) for n in range(math.ceil(first - 0.05), math.floor(last + 0.05) + 1)]
    return {hz: (hz / HALF_THIRD_OCTAVE, hz * HALF_THIRD_OCTAVE) for hz in middles}


def identify(
    pair: Pair, cross: Pair | None = None, *, bearing: Bearing | str | Path, healthy: Recording | None = None,
    band_hz: tuple[float, float] = BAND_HZ,
) -> Identified:  # fmt: skip
    """The path that makes of a run its record; the ratio of its directions from `cross`, or the same pair's sidebands.

    Of a `healthy` record what it has at the same passage is taken off.

    Raises `DataError` for records that cannot be used (unit, no speed, no band or no sideband that shows),
    `ConfigurationError` for a band that lies beyond a record, or a record without a fault.
    """
    bearing = load_bearing(bearing)
    from scipy.special import stdtrit

    bands, powers = record_powers(pair.record, bearing, band_hz, healthy)
    shown = np.array([one.value > one.u for one in powers.values()])
    if not any(one.value > one.u * stdtrit(one.blocks - 1, 1 - CHANCE / len(powers)) for one in powers.values()):
        raise DataError(
            f"{pair.record.name}: no third octave between {band_hz[0]:g} and {band_hz[1]:g} Hz shows power that is "
            "locked to the fault. Widen --band, or use a longer record."
        )
    reach = slice(int(np.argmax(shown)), shown.size - int(np.argmax(shown[::-1])))
    bands = {lowest: bands[lowest] for lowest in list(powers)[reach]}
    levels, u_db = (
        np.array([of(one) if one.value > one.u else math.nan for one in list(powers.values())[reach]])
        for of in (lambda one: decibels(one.value), lambda one: DB * one.u / one.value)
    )
    order = line_order(pair.run, bearing)
    ring = np.array([locked_db(one, bearing, bands, order) for one in ring_parts(pair.run)])
    low_hz, high_hz = next(iter(bands.values()))[0], list(bands.values())[-1][1]
    middles = [one for one in third_octaves(band_hz) if low_hz < one < high_hz]
    place = np.searchsorted(list(bands), middles, side="right") - 1  # of each third octave among the bands read
    turning = cross or (pair if pair.record.state is Fault.INNER else None)
    used = (pair.record.name, *((f"{turning.record.name} (direction)",) if turning else ()))
    own = SensorPath(
        frequency_hz=tuple(middles), load=(1.0,) * len(middles), cross=(1.0,) * len(middles),
        u_db=tuple(_filled(u_db)[place].tolist()), used=used,
        source=f"identified from {' and '.join(used)}, driven by {recording_from_run(pair.run).name}",
    )  # fmt: skip

    def behind_ratio(ratio: float) -> SensorPath:
        excited = 10 ** (ring[0] / 10) + ratio**2 * 10 ** (ring[1] / 10)
        gains = 10 ** (_filled(levels - 10 * np.log10(excited))[place] / 20)
        return replace(own, load=tuple(gains.tolist()), cross=tuple((ratio * gains).tolist()))

    ratio, u, sidebands = _ratio(turning, bearing, behind_ratio) if turning else (1.0, 0.0, None)
    path = replace(behind_ratio(ratio), cross_u_db=u)
    for _ in range(ROUNDS):
        off = 10 ** (_filled(levels - locked_db(behind(pair.run, path), bearing, bands, order))[place] / 20)
        path = replace(path, load=tuple(path.load * off), cross=tuple(path.cross * off))
    each, count = np.unique(place, return_index=True, return_counts=True)[1:]  # joined bands have one gain
    scatter = float(np.std(20 * np.log10(np.array(path.load)[each]), ddof=min(1, each.size - 1)))
    wide = count[place] > 1
    path = replace(path, u_db=tuple(np.hypot(path.u_db, scatter * wide).tolist()))
    return Identified(path=path, record_db=levels[place], ring_db=ring[:, place], sidebands_db=sidebands)


def identify_response(
    frequency_hz: FloatArray, values: ComplexArray, *, mass_kg: float, name: str,
    cross: tuple[FloatArray, ComplexArray] | None = None, band_hz: tuple[float, float] = BAND_HZ,
) -> Identified:  # fmt: skip
    """The path of a measured response [m/s2/N] of the structure that is `mass_kg` of ring and housing in the scene.

    `cross`: frequencies and response to a force across the load; without it both directions are alike. Gains are root
    mean squares over a band.
    """
    bands = third_octaves(band_hz)
    load, other = (
        _band_gains(of, mass_kg, bands, name) for of in ((frequency_hz, values), cross or (frequency_hz, values))
    )
    path = SensorPath(
        frequency_hz=tuple(bands), load=load, cross=other,
        source=f"measured response {name}, {mass_kg:g} kg of ring and housing",
    )  # fmt: skip
    return Identified(path=path, record_db=np.empty(0), ring_db=np.empty(0))


def _band_gains(
    response: tuple[FloatArray, ComplexArray], mass_kg: float, bands: Mapping[float, tuple[float, float]], name: str
) -> tuple[float, ...]:
    at_hz, values = response
    gains = []
    for middle, (low, high) in bands.items():
        inside = np.abs(values[(at_hz >= low) & (at_hz < high)])
        if inside.size < LEAST_LINES or not inside.any():
            raise DataError(
                f"{name}: {np.count_nonzero(inside)} lines that are not zero in the third octave at {middle:.0f} Hz, "
                f"at least {LEAST_LINES} are needed. Narrow --band or measure finer."
            )
        gains.append(mass_kg * math.sqrt(float(np.mean(inside**2))))
    return tuple(gains)


def line_order(run: Run, bearing: Bearing) -> float:
    """The order of the line of a run's fault: by its cage, a roller's where it is found."""
    by_cage = run.scene.defect.kind.passing_order(bearing.rolling_elements, run.cage_ratio)
    return by_cage or found_order(recording_from_run(run), bearing, BAND_HZ)


def found_order(record: Recording, bearing: Bearing, band_hz: tuple[float, float]) -> float:
    """The order of the line of a record's fault where it is found in a band, or else by pure rolling."""
    if record.state not in DEFECTS or record.speed is None:
        raise ConfigurationError(
            f"{record.name}: state {record.state or 'unknown'}, speed {'known' if record.speed else 'unknown'}: a path "
            "is identified from a record of a known fault at a known speed; give --defect and --rpm."
        )
    line = analyse(record, bearing=bearing, band_hz=band_hz).line_of(record.state)
    return (line.found_hz or line.kinematic_hz) / record.speed.value_hz


def ring_parts(run: Run) -> tuple[Recording, Recording]:
    """Recordings of what the ring does along the load and across it, each along the sensor's axis."""
    parts = parts_along_sensor(run.acceleration_m_s2, run.scene.load.direction_rad)
    along, across = (recording_from_run(replace(run, sensor_m_s2=np.ascontiguousarray(one))) for one in parts.T)
    return along, across


def behind(run: Run, path: SensorPath | None) -> Recording:
    """What the sensor shows of a run."""
    sensor = SensorFilter(path, run.scene.output_rate_hz, run.scene.load.direction_rad)
    return recording_from_run(replace(run, sensor_m_s2=sensor.add(run.acceleration_m_s2)))


def joined(bands: Mapping[float, tuple[float, float]], least_hz: float) -> dict[float, tuple[float, float]]:
    """Adjoining third octaves, each narrower than `least_hz` joined with those below it, by their lowest middles [Hz].

    What is too narrow at the low end is left out.
    """
    found, top_hz = dict[float, tuple[float, float]](), math.nan
    for middle, (low, high) in sorted(bands.items(), reverse=True):
        top_hz = high if math.isnan(top_hz) else top_hz
        if top_hz - low >= least_hz:
            found[middle], top_hz = (low, top_hz), math.nan
    return dict(sorted(found.items()))


def record_powers(
    record: Recording, bearing: Bearing, band_hz: tuple[float, float], healthy: Recording | None = None
) -> tuple[dict[float, tuple[float, float]], dict[float, LockedMean]]:
    """Edges [Hz] of the third octaves of a band, `joined` to hold the fault's line, and the power locked to it there.

    Both by lowest middles [Hz]; powers [(m/s2)^2] less what a `healthy` record of the same speed has at the same
    passage, if there is one.
    """
    for one in (record, *([healthy] if healthy else ())):
        if one.unit != "m/s2":
            raise DataError(f"{one.name}: samples in {one.unit!r}; m/s2 is needed. State --unit, or --scale too.")
    limit_hz, bands = 0.5 * record.fs_hz / HALF_THIRD_OCTAVE, third_octaves(band_hz)
    if not bands or max(bands) >= limit_hz:
        raise ConfigurationError(
            f"band {band_hz[0]:g} to {band_hz[1]:g} Hz must rise, hold the middle of a third octave and end below "
            f"{limit_hz:.0f} Hz, for the rate of {record.name}."
        )
    order = found_order(record, bearing, band_hz)
    assert record.speed is not None
    bands = joined(bands, SPACINGS * order * record.speed.value_hz)
    found = locked_powers(record, bearing, order, bands)
    if healthy is not None:
        other = locked_powers(healthy, bearing, order, bands)
        found = {
            lowest: replace(one, value=one.value - other[lowest].value, u=math.hypot(one.u, other[lowest].u))
            for lowest, one in found.items() if lowest in other
        }  # fmt: skip
    return {lowest: bands[lowest] for lowest in found}, found


def locked_db(
    run: Recording, bearing: Bearing, bands: Mapping[float, tuple[float, float]], order: float
) -> FloatArray:  # fmt: skip
    """Power of a run locked to its fault's line [dB re 1 m/s2] in the `bands` that hold two of these lines, [n].

    `ConfigurationError` where the scene's rate does not show them.
    """
    if max(high for _, high in bands.values()) >= 0.5 * run.fs_hz:
        raise ConfigurationError(
            f"output_rate_hz = {run.fs_hz:g} of the scene shows nothing above half of it, the bands go up to "
            f"{max(bands):.0f} Hz: raise output_rate, or end --band lower."
        )
    return np.array([decibels(one.value) for one in locked_powers(run, bearing, order, bands).values()])


def decibels(power: float) -> float:
    """Of a power that may be zero or, by noise, less."""
    return DB * math.log(max(power, 1e-30))


def _filled(values: FloatArray) -> FloatArray:
    """With the values of both neighbours between those that are known; both ends are."""
    known = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(values.size), known, values[known])


def _ratio(
    pair: Pair, bearing: Bearing, behind_ratio: Callable[[float], SensorPath]
) -> tuple[float, float, FloatArray]:
    """The ratio of cross to load, its deviation [dB], and the sidebands of record and run behind it [dB], [2, 2]."""
    from scipy.optimize import minimize_scalar

    band_hz = pair.record.band_hz or (behind_ratio(1.0).low_hz, behind_ratio(1.0).high_hz)
    order = found_order(pair.record, bearing, band_hz)
    read = pattern(pair.record, bearing, Fault.INNER, order, band_hz)
    theirs = [read[f"sidebands {n}"] for n in SIDEBANDS]
    if pair.record.state is not Fault.INNER or not all(one.present for one in theirs):
        raise DataError(
            f"{pair.record.name}: the ratio of the path's directions follows from the sidebands of an inner-race "
            "fault, which do not stand out here. Use another record for --cross-from."
        )
    wanted, u = (np.array(list(one)) for one in zip(*((v.value, (v.ci95 or 0.0) / 1.96) for v in theirs), strict=True))

    def sidebands(log_ratio: float) -> FloatArray:
        shown = behind(pair.run, behind_ratio(math.exp(log_ratio)))
        own = pattern(shown, bearing, Fault.INNER, line_order(pair.run, bearing), band_hz)
        return np.array([own[f"sidebands {n}"].value for n in SIDEBANDS])

    def misfit(log_ratio: float) -> float:
        return float(np.sum(((sidebands(log_ratio) - wanted) / u) ** 2))

    low, high = np.log(RATIOS)
    best = minimize_scalar(misfit, bounds=(low, high), method="bounded", options={"xatol": 0.01})
    step = 0.1
    slope = (sidebands(best.x + step) - sidebands(best.x - step)) / (2 * step)
    u_db = 2 * DB / max(math.sqrt(float(np.sum((slope / u) ** 2))), 2 * DB / WIDEST_DB)  # sidebands may hardly move
    return math.exp(best.x), u_db, np.array([wanted, sidebands(best.x)])


def simulated_run(record: Recording, scene: Scene, *, longest_s: float = math.inf, progress: Progress = silent) -> Run:
    """A run of the scene at the record's speed, load and state, without a path, as long as the record or `longest_s`.

    Raises `NumericsError` where it fails, `ConfigurationError` for a record without a fault or speed.
    """
    if record.state not in DEFECTS or record.speed is None:
        raise ConfigurationError(f"{record.name}: its fault and its speed must be known; give --defect and --rpm.")
    load = scene.load
    if record.radial_n is not None:
        load = replace(load, radial_n=record.radial_n, axial_n=record.axial_n or 0.0)
    own = replace(
        scene, shaft_speed_rad_s=2 * math.pi * record.speed.value_hz, load=load, speed_profile=None, load_profile=None,
        defect=replace(scene.defect, kind=record.state), duration_s=round(min(record.seconds, longest_s), 2),
        sensor_path=None,
    )  # fmt: skip
    return stored_run(own, step=Step.UNCHECKED, progress=progress).require_usable("the run that drives the path")


def path_toml(path: SensorPath) -> str:
    """The path as the file that a scene's `sensor_path` names."""

    def quoted(text: str) -> str:  # a TOML string of printable text; the escapes are JSON's
        return json.dumps("".join(c if c.isprintable() else "?" for c in text), ensure_ascii=False)

    columns = {name: getattr(path, name) for name in ("frequency_hz", "load", "cross", "u_db")}
    return "\n".join([
        f"# {path.source}",
        "# Gains of force times path; the records named in `used` are fitted: no verdict rests on them.",
        *(f"{name} = [{', '.join(f'{value:.6g}' for value in values)}]" for name, values in columns.items() if values),
        f"cross_u_db = {path.cross_u_db:.4g}",
        f"source = {quoted(path.source)}",
        f"used = [{', '.join(quoted(name) for name in path.used)}]\n",
    ])  # fmt: skip
