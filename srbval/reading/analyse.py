"""Analysis of one recording, measured or simulated, from its signal to its fault lines."""

import json
import math
from dataclasses import dataclass, fields, make_dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from srbval.bearing import Bearing, Fault, load_bearing
from srbval.bridges import NotebookObject
from srbval.errors import ConfigurationError, DataError
from srbval.processes.machine import one_thread
from srbval.reading.lines import RACE_LINES, Line, clearness, describe_lines, detected_fault_lines, sidak_corrected
from srbval.reading.pipeline import (
    LEAST_REVOLUTIONS,
    SQUARED_UNIT,
    BandChoice,
    Tracking,
    bands_of_record,
    choose_tracking,
    declared_band,
    process,
    whole_band_of,
)
from srbval.reading.speed_search import SpeedSearch, course_by_comb, search
from srbval.recordings import Origin, Recording, ShaftSpeed
from srbval.recordings.registry import RecordSource, recording_of
from srbval.recordings.settings import settings_of
from srbval.signal import NORMAL_95, end_s
from srbval.signal.envelope import FILTER, FILTER_IN_WORDS, check_band
from srbval.storage.content_store import ContentStore, content_sha256
from srbval.storage.json_files import to_json
from srbval.storage.tables import build

if TYPE_CHECKING:
    import pandas


class ShortRecordError(DataError):
    """Error for a record with too few revolutions to search for lines."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Analysis(SpeedSearch, NotebookObject):
    """Lines of one recording in a `band`; false-alarm probabilities are corrected for all bands and speeds tried."""

    recording: Recording
    band: BandChoice

    @property
    def closure(self) -> dict[str, Any]:
        """Compare BPFO + BPFI with Z f_shaft for Z rolling elements; `why` explains a missing or wrong sum.

        The sum is Z f_shaft for any slip (Randall 2011, sect. 2.2.3); otherwise a line or the stated speed is wrong.
        """
        expected, expected_ci = (self.bearing.rolling_elements * hz for hz in (self.speed.value_hz, self.speed.ci95_hz))
        closure: dict[str, Any] = {"expected_hz": expected, "expected_ci95_hz": expected_ci}
        closure |= dict.fromkeys(("sum_hz", "sum_ci95_hz", "difference_pct", "ci95_pct", "closed"))
        races = [self.line(name) for name in RACE_LINES]
        if missing := [line.name for line in races if not line.detected]:
            why = f"{' and '.join(missing)} not detected in this recording, so there is no sum to compare."
            return closure | {"why": why}
        total = sum(line.found_hz or 0.0 for line in races)
        total_ci = math.hypot(*(line.ci95_hz or 0.0 for line in races))
        difference, ci_pct = 100 * (total / expected - 1), 100 * math.hypot(total_ci / expected, expected_ci / expected)
        closed = abs(difference) <= ci_pct
        why = "" if closed else "The sum is off by more than its uncertainty: speed or a line is wrong."
        found = {"sum_hz": total, "sum_ci95_hz": total_ci, "difference_pct": difference, "ci95_pct": ci_pct}
        return closure | found | {"closed": closed, "why": why}

    @property
    def summary(self) -> str:
        """Detected lines, and lines or a shaft speed found outside the search range, in words."""
        findings = [one.sentence for one in (self.outside, self.outside_speed) if one is not None]
        return " ".join((describe_lines(self.lines, self.speed), *findings))

    def line(self, name: str, harmonic: int = 1) -> Line:
        """Line of this name and harmonic; `KeyError` if it was not searched."""
        return {(line.name, line.harmonic): line for line in self.lines}[name, harmonic]

    def line_of(self, fault: Fault) -> Line:
        """First harmonic of a fault's line."""
        return self.line(fault.line or "")

    def to_frame(self) -> "pandas.DataFrame":
        """Pandas table of all lines, as in `to_dict`; the frequency of a line that is not detected is NaN."""
        import pandas

        return pandas.DataFrame(to_json(self.to_dict()["lines"])).astype(dict.fromkeys(Line.UNSTATED, float))

    def summary_table(self) -> tuple[str, list[dict[str, Any]]]:
        """Summary in words, and a table with the first harmonic of each bearing line, for a notebook."""
        names = ("name", "kinematic_hz", "found_hz", "ci95_hz", "snr", "detected")
        firsts = (line.stated() for line in self.lines if line.is_first)
        return self.summary, [{name: getattr(line, name) for name in names} for line in firsts]

    def __repr__(self) -> str:
        found = [line.name for line in self.lines if line.detected and line.is_first]
        low, high = self.processed.band_hz
        return (
            f"<Analysis of {self.recording.name}: {60 * self.speed.value_hz:.5g} rpm, {low:g} to {high:g} Hz, "
            f"{', '.join(found) or 'no line'} detected>"
        )

    def to_dict(self) -> dict[str, Any]:
        """Values for JSON in SI units, without arrays; None for missing values."""
        of_family = ("name", "false_alarm", "detected", "explained_by")
        firsts = (line for line in self.lines if line.is_first)
        return {
            **{key: getattr(self.recording, key) for key in ("file", "name", "origin", "fs_hz", "seconds")},
            "bearing": self.bearing.name,
            "band_hz": self.processed.band_hz,
            "band_choice": {"why": self.band.why, "trials": self.band.trials},
            "search": self.search,
            "windows": [{"name": n, "low_hz": low, "high_hz": high} for n, (low, high) in self.windows.items()],
            "outside": self.outside,
            "resolution_hz": 1 / self.processed.seconds,
            "chain": {
                "filter": FILTER,
                "filter_in_words": FILTER_IN_WORDS,
                "ends_dropped_s": self.processed.end_s,
                "read_from": "squared envelope",
                "unit": SQUARED_UNIT,
                "standard_deviation": self.processed.scale,
                "standard_deviation_unit": self.recording.unit,
            },
            "order_tracking": {key: getattr(self.processed.tracking, key) for key in ("used", "drift_bins", "why")},
            "shaft_hz": {
                "value": self.speed.value_hz,
                "ci95": self.speed.ci95_hz,
                **{key: getattr(self.speed, key) for key in ("source", "drift_hz", "spread_hz")},
                "nominal_rpm": self.recording.nominal_rpm,
                "outside": self.outside_speed,
            },
            "lines": [line.stated() for line in self.lines],
            "families": [
                {name: getattr(x, name) for name in of_family} | {"state": x.not_detected or "detected"} for x in firsts
            ],
            "closure": self.closure,
            "summary": self.summary,
            "notes": self.recording.notes,
            "cautions": self.recording.cautions,
        } | {key: x for key in ("cage_ratio", "resampling_error") if (x := getattr(self.recording, key)) is not None}


READINGS = ContentStore(kind="reading", computed_by=__name__)
# Fields of an analysis that take long to compute: all but the record, the bearing and the processed signal.
_SLOW_FIELDS = [(x.name, x.type) for x in fields(Analysis) if x.name not in ("recording", "bearing", "processed")]
StoredReading = make_dataclass("StoredReading", _SLOW_FIELDS, frozen=True)


@one_thread()
def analysis_once(recording: Recording, bearing: Bearing, **bands: Any) -> Analysis:
    """Analyse a recording as `analyse` does, or read the stored result; `bands`: the options that choose the band.

    The result is not stored if the lines were found by following a drifting shaft speed.
    """
    content = content_sha256(recording, bearing, bands)
    table = READINGS.load(content, dict)
    if table is None:
        found = analyse(recording, bearing=bearing, **bands)
        if found.recording is not recording:  # it got a caution: its speed drifts
            return found
        table = {name: getattr(found, name) for name, _ in _SLOW_FIELDS}
        table = json.loads(json.dumps(table | {"lines": [vars(line) for line in found.lines]}, default=to_json))
        READINGS.save(content, table)
    stored: Any = build(StoredReading, table, "reading")
    tracking = choose_tracking(recording, bearing, recording.known_speed)
    processed = process(recording, band_hz=stored.band.band_hz, tracking=tracking)
    return Analysis(**vars(stored), recording=recording, bearing=bearing, processed=processed)


@one_thread()
def analyse(
    source: RecordSource,
    *,
    bearing: Bearing | str | Path | None = None,
    speed: ShaftSpeed | None = None,
    band_hz: tuple[float, float] | None = None,
    auto_band: bool = False,
    whole_band: bool = False,
    healthy: RecordSource | None = None,
    trials: int = 1,
    **stated: Any,
) -> Analysis:
    """Read the fault lines of a bearing in a recording, a file or a run.

    The default `bearing` is the one stated in the record. `stated` are fields of `RecordingSettings` such as `rpm`,
    `channel`, `fs_hz`, `unit`. `speed` and `band_hz` [Hz] override the values of the recording. With `auto_band`, or if
    no band is stated, the band is chosen from the record (`bands_of_record`), below half the sampling rate of a
    `healthy` record so that both can be compared; with `whole_band` the whole band is used if no band is stated. If
    only a nominal shaft speed is known, it is replaced by an estimate from the record within its tolerance, if the
    record allows one. `trials` is the number of parts of a long record among which this part was chosen. Raises
    `ConfigurationError` for a missing speed, a missing bearing or an impossible band, `DataError` for a constant or
    short record, and the errors of `load_recording`.
    """
    recording = recording_of(source, settings_of(stated))
    bearing = bearing_of(recording, bearing)
    known_speed = recording.known_speed if speed is None else speed
    if auto_band and band_hz is not None:
        raise ConfigurationError("band_hz and auto_band (--band, --auto-band) are both given: leave one of them out.")
    declared = None if auto_band else declared_band(recording, band_hz, bearing)
    if declared is None and not whole_band:
        bands = bands_of_record(recording, bearing, known_speed, recording_of(healthy).fs_hz if healthy else math.inf)
    else:
        bands = (declared or whole_band_of(recording.fs_hz),)
    tracking = choose_tracking(recording, bearing, known_speed)
    known_speed = with_spread(known_speed, tracking)
    bands = tuple(replace(band, trials=trials * band.trials) for band in bands)
    found = _clearest(recording, bearing, known_speed, bands, tracking, trials)
    if tracking.course is None and recording.origin is Origin.MEASURED and not detected_fault_lines(found.lines):
        drifting = course_by_comb(found.processed, bearing, known_speed)
        if drifting is not None:
            followed = _clearest(recording, bearing, known_speed, bands, drifting, trials)
            if detected_fault_lines(followed.lines):  # else the comb may be rounding or another source
                return replace(followed, recording=replace(recording, cautions=(*recording.cautions, drifting.why)))
    return found


def with_spread(speed: ShaftSpeed, tracking: Tracking) -> ShaftSpeed:
    """Shaft speed whose 95 % interval contains the speed of any part of the record, unless it is tracked."""
    if tracking.used or not speed.spread_hz:
        return speed
    return replace(speed, ci95_hz=math.hypot(speed.ci95_hz, NORMAL_95 * speed.spread_hz))


def _clearest(
    recording: Recording,
    bearing: Bearing,
    known_speed: ShaftSpeed,
    bands: tuple[BandChoice, ...],
    tracking: Tracking,
    trials: int,
) -> Analysis:
    """Search for the lines in each of `bands`; returns the analysis in the band in which the lines are clearest."""
    analyses = []
    for band in bands:
        check_band(band.band_hz, recording.fs_hz)
        ends_s = end_s(band.band_hz)
        left_s = max(0.0, recording.seconds - 2 * ends_s)
        revolutions = round(left_s * known_speed.value_hz, 1)
        if revolutions < LEAST_REVOLUTIONS:
            raise ShortRecordError(
                f"{recording.name}: without the ends, which the filter distorts, {left_s:.3g} s ({revolutions:g} "
                f"revolutions) remain; at least {LEAST_REVOLUTIONS} revolutions are needed to separate a fault line "
                f"from shaft lines. Record at least {LEAST_REVOLUTIONS / known_speed.value_hz + 2 * ends_s:.3g} s."
            )
        processed = replace(process(recording, band_hz=band.band_hz, tracking=tracking), trials=trials)
        found = search(processed, bearing, known_speed)
        lines = sidak_corrected(found.lines, found.tried * band.trials, found.tried * len(bands) * trials)
        analyses.append(Analysis(**vars(found) | {"lines": lines}, recording=recording, band=band))
    return max(analyses, key=lambda one: clearness(one.lines))


def bearing_of(
    recording: Recording, given: Bearing | str | Path | None = None, *, largest_slip_pct: float | None = None
) -> Bearing:
    """Return the `given` bearing (object, name or file) or the record's; `largest_slip_pct` replaces its slip limit."""
    known = given or recording.own_bearing or recording.bearing
    if known is None:
        raise ConfigurationError(
            f"{recording.name}: neither the file nor its data set names the bearing; give --bearing: a known one "
            "(srbval bearing list) or a TOML file."
        )
    bearing = load_bearing(known)
    return bearing if largest_slip_pct is None else bearing.with_slip(largest_slip_pct)
