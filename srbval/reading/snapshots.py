"""Snapshots: records too short to search for lines. Their levels, and their modulation at the lines, can be pooled."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from srbval.bearing import DEFECTS, Bearing
from srbval.errors import ConfigurationError
from srbval.reading.analyse import Analysis
from srbval.reading.features import features_of
from srbval.reading.pipeline import declared_band, process, whole_band_of
from srbval.recordings import Recording
from srbval.signal.envelope import END_PERIODS

BESIDE = (-2.0, -1.5, 1.5, 2.0)  # places of the neighbourhood, in widths of a line
POOLED_REVOLUTIONS = 30.0


def snapshot_of(recording: Recording, bearing: Bearing, band_hz: tuple[float, float] | None) -> dict[str, Any]:
    """Document of a snapshot as far as a trend needs it, in the band given or stated, or else in the whole band.

    `depth` of a line is the modulation of the squared envelope at its kinematic frequency, `snr` its power over that
    beside it. A line is as wide as two over the duration, so it is not told from a multiple of the shaft within that.
    """
    if (speed := recording.speed) is None:
        raise ConfigurationError(f"{recording.name}: neither the file nor its data set states a speed; give --rpm.")
    band = declared_band(recording, band_hz, bearing) or whole_band_of(recording)
    ends_s = END_PERIODS / (band.band_hz[1] - band.band_hz[0])
    done = process(recording, band_hz=band.band_hz, ends_s=ends_s)
    read = Analysis(processed=done, bearing=bearing, lines=(), speed=speed, recording=recording, band=band)
    time_s, window = np.arange(done.squared.size) / done.squared_fs_hz, np.hanning(done.squared.size)
    modulation, lines = window * (done.squared / done.squared.mean() - 1), []
    for fault in DEFECTS:
        at_hz = fault.line_order(bearing.orders) * speed.value_hz + 2 / done.seconds * np.array((0.0, *BESIDE))
        waves = np.exp(-2j * math.pi * np.outer(at_hz, time_s))
        power, *beside = np.abs(2 * waves @ modulation / window.sum()) ** 2
        depth, snr = math.sqrt(power), float(power / np.mean(beside))
        lines.append({"name": fault.line, "harmonic": 1, "depth": depth, "snr": snr, "detected": False})
    return {
        **{key: getattr(recording, key) for key in ("file", "channel", "seconds")},
        "snapshot": True,
        "shaft_hz": {"value": speed.value_hz},
        "features": features_of(read),
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
