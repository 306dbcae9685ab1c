"""Whether the shaft's speed drifts so far that its course must be followed."""

from __future__ import annotations

from srbval.bearing import Bearing
from srbval.recordings import Recording, ShaftSpeed, SpeedSource
from srbval.signal import ShaftAngle
from srbval.validation.pipeline import Tracking

# A line that moves by more than this many bins in the record is smeared over them.
MOST_BINS = 1.0
MEASURED = (SpeedSource.TACHOMETER, SpeedSource.PRESCRIBED)
# Share of the record that the speed signal must cover.
LEAST_COVER = 0.98


def choose_tracking(recording: Recording, bearing: Bearing, speed: ShaftSpeed) -> Tracking:
    """Follow the speed signal where the higher race line moves by more than a bin; say so either way.

    Needs a speed signal over the whole record that `speed` is the mean of. Raises `DataError` for one in which the
    shaft stops.
    """
    signal = recording.speed_signal
    if signal is None or speed is not recording.speed or speed.source not in MEASURED:
        return Tracking(why="no order tracking: the speed used comes without its course")
    if signal.values_hz.size / signal.rate_hz < LEAST_COVER * recording.seconds:
        return Tracking(why="no order tracking: the speed signal is shorter than the record")
    course = ShaftAngle.from_speed(signal.values_hz, signal.rate_hz)
    bins = course.drift_bins(max(bearing.orders.bpfo, bearing.orders.bpfi))
    if bins <= MOST_BINS:
        return Tracking(
            why=f"no order tracking: with the speed the race lines move by {bins:.2f} bins, not more than one",
            drift_bins=bins,
        )
    return Tracking(
        why=f"order tracking: with the speed the race lines move by {bins:.1f} bins; resampled to even shaft angles, "
        "frequencies are those at the mean speed",
        drift_bins=bins,
        course=course,
        mean_hz=speed.value_hz,
    )
