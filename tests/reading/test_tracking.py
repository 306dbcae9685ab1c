import dataclasses

import numpy as np
import pytest

from srbval import analyse, simulate, write_run
from srbval.recordings import SpeedSignal, load_recording, recording_from_run
from srbval.recordings.speed import tachometer_speed
from srbval.scene import SpeedProfile, paper_scene
from tests.reading.test_analyse import BEARING, FS_HZ, SECONDS, SHAFT_HZ, recording, rings

RAMP = 0.05  # of the mean speed, from the first sample to the last
SLIP = 1.002
READING_PCT = 0.03


def ramped():
    """Impulses of a fault at even shaft angles while the shaft speeds up by 5 %."""
    time_s = np.arange(round(SECONDS * FS_HZ)) / FS_HZ
    turns = SHAFT_HZ * ((1 - RAMP / 2) * time_s + RAMP * time_s**2 / (2 * SECONDS))
    strikes = np.arange(1, turns[-1] * BEARING.orders.bpfo * SLIP - 2) / (BEARING.orders.bpfo * SLIP)
    return rings(np.interp(strikes, turns, time_s), np.ones(strikes.size))


def with_tachometer():
    speed = SHAFT_HZ * np.linspace(1 - RAMP / 2, 1 + RAMP / 2, 2560)
    return recording(
        ramped(), speed=tachometer_speed(speed), speed_signal=SpeedSignal(values_hz=speed, rate_hz=speed.size / SECONDS)
    )


def test_a_fault_on_a_speed_ramp_is_read_only_because_the_speed_signal_is_followed():
    record = with_tachometer()
    with_course = analyse(record, bearing=BEARING)
    assert with_course.processed.tracking.used
    assert with_course.to_dict()["order_tracking"]["drift_bins"] > 20
    line = with_course.line("BPFO")
    assert line.detected
    assert line.deviation_pct == pytest.approx(100 * (SLIP - 1), abs=READING_PCT)
    without = analyse(dataclasses.replace(record, speed_signal=None), bearing=BEARING).line("BPFO")
    # Its mean may still come out, since the course of its phase is followed, but far less surely.
    assert without.ci95_hz > 20 * line.ci95_hz
    assert without.snr < line.snr / 3


RAMP_RAD_S = (70.0, 78.0)


def test_a_simulated_ramp_reads_the_model_s_own_line_from_memory_and_from_its_file(tmp_path):
    ramp = SpeedProfile(time_s=(0.0, 4.0), speed_rad_s=RAMP_RAD_S)
    scene = paper_scene(model="impulse", duration_s=4.0, defect={"kind": "outer"})
    run = simulate(dataclasses.replace(scene, speed_profile=ramp))
    write_run(run, tmp_path / "ramp.h5")
    for record in (recording_from_run(run), load_recording(tmp_path / "ramp.h5")):
        analysis = analyse(record, bearing=BEARING)
        line = analysis.line("BPFO")
        assert analysis.processed.tracking.used
        assert line.detected
        assert line.found_hz == pytest.approx(run.bpfo_hz, rel=READING_PCT / 100)
        without = analyse(dataclasses.replace(record, speed_signal=None), bearing=BEARING).line("BPFO")
        assert not without.detected or abs(without.found_hz / run.bpfo_hz - 1) > 3 * READING_PCT / 100
