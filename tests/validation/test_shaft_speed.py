"""The shaft speed estimated from fault harmonics and shaft sidebands: right, covered, and silent on noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from srbval.bearing import load_bearing
from srbval.recordings import Origin, Recording, SpeedSource, State, load_recording
from srbval.recordings.speed import nominal_speed
from srbval.validation.analyse import analyse

FS_HZ, SECONDS = 12000.0, 3.0
BEARING = load_bearing("skf-6205")
# The loosest a right estimate may be here: the declared allowance and a little for the fit.
TOLERANCE = 1e-3


def record(*, shaft_hz: float, slip: float = 0.0, seed: int = 0, fault: bool = True) -> Recording:
    """Inner-race impacts at a slipping cage's rate, struck harder once a turn, ringing at 3.5 kHz, in noise."""
    rng = np.random.default_rng(seed)
    n = int(FS_HZ * SECONDS)
    signal = rng.normal(0, 0.3, n)
    if fault:
        rate = BEARING.orders.bpfi * shaft_hz * (1 + slip)
        at = np.arange(0.01, SECONDS - 0.02, 1 / rate) + rng.normal(
            0, 2e-5, len(np.arange(0.01, SECONDS - 0.02, 1 / rate))
        )
        strength = 1 + 0.6 * np.cos(2 * np.pi * shaft_hz * at)
        steps = np.arange(int(0.004 * FS_HZ))
        for time, hit in zip(at, strength, strict=True):
            first = int(np.ceil(time * FS_HZ))
            t = (first + steps) / FS_HZ - time
            signal[first : first + steps.size] += hit * np.exp(-900 * t) * np.sin(2 * np.pi * 3500 * t)
    return Recording(
        name="made for the test",
        origin=Origin.MEASURED,
        channels={"x": signal},
        fs_hz=FS_HZ,
        unit="m/s2",
        channel="x",
        bearing="skf-6205",
        state=State.INNER,
        nominal_rpm=1500.0,
        speed=nominal_speed(1500.0, 1.5),
        band_hz=(2000.0, 5000.0),
    )


@pytest.mark.parametrize(("shaft_hz", "slip"), [(24.65, 0.0), (25.0, 0.006), (25.21, 0.006)])
def test_speed_and_slip_are_told_apart(shaft_hz: float, slip: float) -> None:
    result = analyse(record(shaft_hz=shaft_hz, slip=slip), bearing=BEARING)
    assert result.speed.source is SpeedSource.ESTIMATED
    assert result.speed.value_hz == pytest.approx(shaft_hz, rel=TOLERANCE)
    assert abs(result.speed.value_hz - shaft_hz) <= result.speed.ci95_hz
    assert result.speed.ci95_hz < 2 * TOLERANCE * shaft_hz
    assert result.line("BPFI").deviation_pct == pytest.approx(100 * slip, abs=0.15)


def test_noise_gives_no_speed() -> None:
    for seed in range(2):
        result = analyse(record(shaft_hz=25.0, seed=seed, fault=False), bearing=BEARING)
        assert result.speed.source is SpeedSource.NOMINAL


@pytest.mark.slow
@pytest.mark.recordings
def test_intervals_cover_the_measured_speeds(recordings_dir: Path) -> None:
    """CWRU states integer rpm: the estimate without it must cover it in at least 95 % of the records."""
    covered = estimated = 0
    for path in sorted((recordings_dir / "cwru").glob("*.mat")):
        recording = load_recording(path)
        if recording.speed is None or recording.speed.source is not SpeedSource.STATED or recording.bearing is None:
            continue
        nominal = nominal_speed(recording.nominal_rpm or 1797.0, 1.5)
        found = analyse(recording, bearing=load_bearing(recording.bearing), speed=nominal).speed
        if found.source is SpeedSource.ESTIMATED:
            estimated += 1
            covered += abs(found.value_hz - recording.speed.value_hz) <= found.ci95_hz
    if estimated == 0:
        pytest.skip("no CWRU record among the recordings")
    assert estimated >= 14
    assert covered >= 0.95 * estimated
