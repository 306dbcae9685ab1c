"""Snapshots: records too short to search for lines. Their levels, and their modulation at the lines, can be pooled."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from srbval.bearing import DEFECTS, Bearing
from srbval.errors import ConfigurationError
from srbval.reading.pipeline import declared_band, one_signal, whole_band_of
from srbval.recordings import Recording
from srbval.signal import kurtosis, normalise, squared_envelope_one_pass

SPOILED = 0.05  # share of a snapshot that the filter spoils at either end
BESIDE = (-2.0, -1.5, 1.5, 2.0)  # places of the neighbourhood, in widths of a line
POOLED_REVOLUTIONS = 30.0


def snapshot_of(recording: Recording, bearing: Bearing, band_hz: tuple[float, float] | None) -> dict[str, Any]:
    """Document of a snapshot as far as a trend needs it, in the band given or stated, or else in the whole band.

    `depth` of a line is the modulation of the squared envelope at its kinematic frequency, `snr` its power over that
    beside it. A line is as wide as two over the duration, so it is not told from a multiple of the shaft within that.
    """
    if recording.speed is None:
        raise ConfigurationError(f"{recording.name}: neither the file nor its data set states a speed; give --rpm.")
    signal, shaft_hz = one_signal(recording), recording.speed.value_hz
    band = declared_band(recording, band_hz, bearing) or whole_band_of(recording)
    square, rate_hz = squared_envelope_one_pass(normalise(signal), recording.fs_hz, band.band_hz)
    cut, scale = round(SPOILED * square.size), float(np.std(signal))
    square = square[cut : square.size - cut]
    time_s, window = np.arange(square.size) / rate_hz, np.hanning(square.size)
    modulation, width_hz = window * (square / square.mean() - 1), 2 * rate_hz / square.size
    lines = []
    for fault in DEFECTS:
        at_hz = fault.line_order(bearing.orders) * shaft_hz + width_hz * np.array((0.0, *BESIDE))
        waves = np.exp(-2j * math.pi * np.outer(at_hz, time_s))
        power, *beside = np.abs(2 * waves @ modulation / window.sum()) ** 2
        depth, snr = math.sqrt(power), float(power / np.mean(beside))
        lines.append({"name": fault.line, "harmonic": 1, "depth": depth, "snr": snr, "detected": False})
    peak = float(np.abs(signal - signal.mean()).max())
    features = {"unit": recording.unit, "rms": scale, "peak": peak, "crest": peak / scale, "kurtosis": kurtosis(signal)}
    features |= {"band_rms": scale * math.sqrt(float(square.mean()) / 2), "velocity_rms_mm_s": None}
    return {
        **{key: getattr(recording, key) for key in ("file", "name", "origin", "channel", "seconds")},
        "bearing": bearing.name,
        "snapshot": True,
        "shaft_hz": {"value": shaft_hz},
        "features": features | {"velocity_missing": f"snapshots of {recording.seconds:.3g} s are too short"},
        "lines": lines,
        "fault": {"verdict": None, "called": None, "probabilities": {}},
    }


def pooled(snapshots: Sequence[Mapping[str, Any]], groups: int) -> list[dict[str, Any]]:
    """Snapshots in their order, as one document for each of at least `groups` groups of `POOLED_REVOLUTIONS`.

    Powers are averaged; a group has the file and the time of its last snapshot.
    """
    turns = sum(one["seconds"] * one["shaft_hz"]["value"] for one in snapshots)
    count = min(len(snapshots), max(groups, round(turns / POOLED_REVOLUTIONS)))
    found = []
    for places in np.array_split(np.arange(len(snapshots)), count):
        own = [snapshots[n] for n in places]
        lines = []
        for line in zip(*(one["lines"] for one in own), strict=True):
            power = float(np.mean([each["depth"] ** 2 for each in line]))
            beside = float(np.mean([each["depth"] ** 2 / each["snr"] for each in line]))
            lines.append(line[-1] | {"depth": math.sqrt(power), "snr": len(own) * power / beside})
        levels = {
            name: math.sqrt(float(np.mean([one["features"][name] ** 2 for one in own]))) for name in ("rms", "band_rms")
        }
        found.append({**own[-1], "features": own[-1]["features"] | levels, "lines": lines})
    return found
