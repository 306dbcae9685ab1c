"""Trend of the records of one machine: levels of its fault lines, RMS, velocity, and the first alarm.

The level of a fault in a record is the RMS in the band times the root of the fault line's modulation depth in the
squared envelope. The baseline is b records of one speed among the first of the history; m and s are mean and standard
deviation of the logarithms of their levels. A level has risen if its logarithm x is above their prediction limit::

    x - m > t(b - 1, 1 - alpha / K) s sqrt(1 + 1 / b)

t is the quantile of Student's distribution. This is the limit for one further value of the same normal distribution
(Hahn 1969, J. Am. Stat. Assoc. 64, 878; quoted from memory, not checked). K is the number of levels compared: by
Bonferroni's inequality the chance of any false alarm in the whole history is at most alpha, if the healthy machine does
not change. A change of load or temperature can raise a level, too, without a fault.
"""

import itertools
import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from scipy.special import stdtrit

from srbval.bearing import DEFECTS, Fault
from srbval.diagnosis.baseline import SAME_SHARE
from srbval.errors import ConfigurationError, UnknownNameError
from srbval.reading.features import pool_snapshots
from srbval.signal import NORMAL_95
from srbval.storage.tables import read_toml

if TYPE_CHECKING:
    import pandas

ALPHA = 0.05
LEAST_BASELINE, MOST_BASELINE, BASELINE_SHARE = 5, 20, 1 / 3  # records: the scatter of fewer is unknown
MIN_POOLED_GROUPS = 12  # groups of snapshots: a baseline, and as many more to compare
RMS = "RMS"
DB_PER_NEPER = 20 / math.log(10)  # of an amplitude's logarithm


@dataclass(frozen=True, kw_only=True)
class ChannelTrend:
    """Trend of one channel: its records in the order of time, and the limits of its levels.

    Each of the `points` is a record: its file, time, speed [rpm], RMS velocity and ISO zone; the `levels` of lines and
    RMS in the recording's unit; the 95 % half widths `ci95_db` of the lines' levels [dB]; the names of the `risen`
    levels; and `comparable`, false if the speed differs from the median speed of the first records (such a record is
    not compared, and not part of the baseline). `reference` contains the geometric mean of each level over the
    baseline, `limits` the value above which a level has risen, `zones` the least velocities of zones B, C and D [mm/s].
    `velocity_missing` is the reason for a missing velocity or zone.
    """

    channel: str | None
    unit: str
    points: tuple[dict[str, Any], ...]
    reference: Mapping[str, float]
    limits: Mapping[str, float]
    zones: tuple[tuple[str, float], ...]
    velocity_missing: str

    def rise_db(self, levels: Mapping[str, float], name: str) -> float | None:
        """Rise [dB] of the level `name` in `levels` over the baseline's mean level; None if either is missing."""
        value, before = levels.get(name), self.reference.get(name)
        return DB_PER_NEPER * math.log(value / before) if value and before else None

    @staticmethod
    def time_text(point: Mapping[str, Any]) -> str:
        """Format the time of one of the `points` as a date or a number."""
        time = point["time"]
        return time.isoformat(" ", "minutes") if isinstance(time, datetime) else f"{time:g}"

    @property
    def first_alarm(self) -> int | None:
        """Index of the first record in which a level has risen; None without an alarm."""
        return next((n for n, point in enumerate(self.points) if point["risen"]), None)


@dataclass(frozen=True, kw_only=True)
class Trend:
    """Trends of all channels; `comparisons` is the number of levels compared with the first `baseline` records.

    `false_alarm` is the chance of any false alarm in the whole history; `time_from` names the source of the times.
    """

    JSON_PROPERTIES: ClassVar = ("answer", "alarm")

    channels: tuple[ChannelTrend, ...]
    time_from: str
    baseline: int
    comparisons: int
    false_alarm: float = ALPHA

    @property
    def alarm(self) -> ChannelTrend | None:
        """Trend of the channel with the first alarm; None without an alarm."""
        found = [one for one in self.channels if one.first_alarm is not None]
        return min(found, key=lambda one: one.first_alarm or 0, default=None)

    def rows(self) -> Iterator[dict[str, Any]]:
        """Table with a row per record and channel: levels of lines and RMS, velocity, zone, names of risen levels."""
        for one, point in ((channel, point) for channel in self.channels for point in channel.points):
            levels = {f"{name}_{one.unit}": point["levels"].get(name) for name in one.reference}
            row = {"channel": one.channel, "time": one.time_text(point), "file": point["file"], "rpm": point["rpm"]}
            severity = {name: point[name] for name in ("velocity_rms_mm_s", "zone")}
            yield row | levels | severity | {"risen": " ".join(point["risen"])}

    def to_frame(self) -> "pandas.DataFrame":
        """Pandas table of the `rows`."""
        import pandas

        return pandas.DataFrame(self.rows())

    @property
    def answer(self) -> str:
        """Sentence on the first alarm: its time, the line (or else RMS) that rose most, and the false-alarm chance."""
        count = max(len(one.points) for one in self.channels)
        first = self.alarm
        if not self.comparisons:
            return (
                f"No alarm can be computed from {count} records: a baseline needs {LEAST_BASELINE} records of the same "
                "speed, and one more to compare."
            )
        chance = f"the chance of any false alarm in the whole history is at most {100 * self.false_alarm:.0f} %"
        if first is None or first.first_alarm is None:
            return f"No alarm in {count} records: no level rose above the first {self.baseline} records; {chance}."
        last_rises = {  # of each level that has risen, in its last record above the limit; a later one replaces it
            (number, name): (name != RMS, one.rise_db(point["levels"], name) or 0.0, n)
            for number, one in enumerate(self.channels)
            for n, point in enumerate(one.points)
            for name in point["risen"]
        }
        number, name = max(last_rises, key=last_rises.__getitem__)
        one, (_, rise_db, _) = self.channels[number], last_rises[number, name]
        n = next(n for n, point in enumerate(one.points) if name in point["risen"])
        since, part = one.points[n:], Fault.of_line(name)
        lasting, where = sum(name in point["risen"] for point in since), f" of {one.channel}" if one.channel else ""
        start = first.points[first.first_alarm]
        earlier = f"; first alarm: {start['risen'][0]} at {first.time_text(start)}" if first.first_alarm < n else ""
        return (
            f"Alarm: {f'{part.label} line ({name})' if part else name}{where} {rise_db:+.1f} dB since "
            f"{one.time_text(since[0])} (record {n + 1} of {count}), over its limit in {lasting} of {len(since)} "
            f"records from then on{earlier}; {chance}."
        )


def zone_boundaries(machine_class: str | None) -> tuple[float, ...]:
    """Velocities [mm/s] between zones A, B, C and D of ISO 20816-3 for a class of machine; empty for None."""
    classes = read_toml(Path(__file__).with_name("iso_20816_3.toml"))["boundaries_mm_s"]
    if machine_class is not None and machine_class not in classes:
        raise UnknownNameError.of(f"--machine-class {machine_class!r} is not known", machine_class, classes)
    return tuple(classes[machine_class]) if machine_class else ()


def zone_of(velocity_mm_s: float | None, boundaries: Sequence[float]) -> str | None:
    """Zone of ISO 20816-3, A to D, for an RMS velocity [mm/s]; None without a velocity or boundaries."""
    if velocity_mm_s is None or not boundaries:
        return None
    return "ABCD"[int(np.searchsorted(boundaries, velocity_mm_s))]


def trend_of(
    documents: Sequence[Mapping[str, Any]],
    times: Mapping[str, datetime | float],
    *,
    time_from: str = "",
    baseline: int | None = None,
    machine_class: str | None = None,
    zones_mm_s: Sequence[float] = (),
) -> Trend:
    """Compute the trend of the `documents` of `read_records`, by channel; `times` contains the time of each file.

    Limits follow from the first `baseline` records (default: a third of all, at least `LEAST_BASELINE`, at most
    `MOST_BASELINE`), without records of another speed. `zones_mm_s` are the velocities at which zones B, C and D begin
    (default: by `machine_class`).
    """
    import pandas as pd

    in_order = sorted(documents, key=lambda one: (one["channel"] or "", times[one["file"]]))
    groups = itertools.groupby(in_order, key=lambda one: one["channel"])
    by_channel: dict[str | None, Sequence[Mapping[str, Any]]] = {channel: [*own] for channel, own in groups}
    if all(one.get("snapshot") for one in documents):
        by_channel = {channel: [*pool_snapshots(own, MIN_POOLED_GROUPS)] for channel, own in by_channel.items()}
        time_from += f"; {len(documents)} snapshots, pooled for lines"
    share = round(BASELINE_SHARE * max(map(len, by_channel.values())))
    count = baseline or max(LEAST_BASELINE, min(MOST_BASELINE, share))
    if count < LEAST_BASELINE:
        raise ConfigurationError(f"--baseline {count}: the baseline needs at least {LEAST_BASELINE} records.")
    boundaries = zones_mm_s or zone_boundaries(machine_class)

    def point_of(one: Mapping[str, Any], usual_hz: float) -> dict[str, Any]:
        features, shaft_hz = one["features"], one["shaft_hz"]["value"]
        lines = [x for x in one["lines"] if x["harmonic"] == 1 and x["depth"] and x["snr"]]
        levels = {x["name"]: features["band_rms"] * math.sqrt(x["depth"]) for x in lines}
        return {
            "file": one["file"],
            "time": times[one["file"]],
            "rpm": 60 * shaft_hz,
            "levels": levels | {RMS: features["rms"]},
            # a line of power rho over noise: 8.69 / sqrt(2 rho) dB; a level is the root of the depth
            "ci95_db": {x["name"]: DB_PER_NEPER / 2 * NORMAL_95 * math.sqrt(0.5 / max(x["snr"], 0.5)) for x in lines},
            "velocity_rms_mm_s": features["velocity_rms_mm_s"],
            "zone": zone_of(features["velocity_rms_mm_s"], boundaries),
            "comparable": abs(shaft_hz / usual_hz - 1) <= SAME_SHARE,
        }

    series, before, comparisons = {}, {}, 0
    for channel, found in by_channel.items():
        usual_hz = statistics.median_low(one["shaft_hz"]["value"] for one in found[:count])
        series[channel] = [point_of(one, usual_hz) for one in found]
        names = [*(fault.line or "" for fault in DEFECTS), RMS]
        levels = pd.DataFrame([p["levels"] for p in series[channel]], columns=names)
        levels = levels[[p["comparable"] for p in series[channel]]]  # its index is the number of the record
        before[channel] = levels[levels.index < count]
        comparisons += int(levels.loc[count:, before[channel].count() >= LEAST_BASELINE].count().sum())
    channels, no_zone = [], "" if boundaries else "no class of machine: --machine-class"
    for channel, points in series.items():
        features = by_channel[channel][0]["features"]
        logs = np.log(before[channel].dropna(axis="columns", how="all"))
        known = logs.count()
        factor = -stdtrit(known - 1, ALPHA / max(1, comparisons)) * np.sqrt(1 + 1 / known)
        limits = np.exp(logs.mean() + factor * logs.std())[known >= LEAST_BASELINE].to_dict() if comparisons else {}
        for n, point in enumerate(points):
            passed = [name for name, limit in limits.items() if point["levels"].get(name, 0.0) > limit]
            point["risen"] = passed if n >= count and point["comparable"] else []
        channels.append(
            ChannelTrend(
                channel=channel,
                unit=features["unit"],
                velocity_missing=features["velocity_missing"] or no_zone,
                limits=limits,
                zones=tuple(zip("BCD", boundaries, strict=False)),
                reference=np.exp(logs.mean()).to_dict(),
                points=tuple(points),
            )
        )
    count = min(count, max(map(len, series.values())))
    return Trend(channels=tuple(channels), time_from=time_from, baseline=count, comparisons=comparisons)
