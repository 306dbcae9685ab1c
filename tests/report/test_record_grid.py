"""Records of any sampling rate, length and speed: a report, or a reason that is true."""

from __future__ import annotations

import itertools
import re

import numpy as np
import pytest
import scipy.signal

from srbval.bearing import load_bearing
from srbval.diagnosis.records import RecordRequest
from srbval.errors import DataError
from srbval.reading.lines import detected_fault_lines
from srbval.reading.pipeline import LEAST_REVOLUTIONS
from srbval.recordings import Origin, Recording
from srbval.recordings.speed import stated_speed
from srbval.report.findings.user_records import UserRecord, gather_user_records
from srbval.signal.envelope import END_S

BEARING = load_bearing("skf-6205")
RATES_HZ = (2000.0, 8192.0, 12_000.0, 48_000.0, 102_400.0)
SECONDS = (0.25, 1.5, 4.0)
SPEEDS_RPM = (30.0, 120.0, 300.0, 600.0, 1200.0, 3000.0, 6000.0)

MOSTLY = 0.8  # of the records that are long enough: at 2 kHz and 6,000 rpm the line is beyond reach


def outer_race(fs_hz: float, seconds: float, rpm: float, *, strength: float = 1.0) -> Recording:
    """Impacts at BPFO that ring at three tenths of the sampling rate, in noise."""
    samples = 0.1 * np.random.default_rng(0).standard_normal(round(fs_hz * seconds))
    hits = np.zeros(samples.size)
    hits[(np.arange(0.003, seconds, 60 / rpm / BEARING.orders.bpfo) * fs_hz).astype(int)] = strength
    step = np.arange(round(0.02 * fs_hz))
    ringing = np.exp(-0.015 * step) * np.sin(0.6 * np.pi * step)
    return Recording(
        name="made for the test",
        origin=Origin.MEASURED,
        fs_hz=fs_hz,
        unit="m/s2",
        channel="x",
        bearing=BEARING.name,
        channels={"x": samples + scipy.signal.fftconvolve(hits, ringing)[: samples.size]},
        speed=stated_speed(rpm, min(1.0, 0.02 * rpm)),
    )


def gathered(recording: Recording, healthy: Recording | None = None) -> UserRecord:
    request = RecordRequest(bearing=BEARING.name, auto_band_if_undeclared=True)
    records, *_ = gather_user_records([recording], request, healthy=healthy, model=False)
    return records[0]


@pytest.mark.parametrize("fs_hz", RATES_HZ)
def test_each_rate_length_and_speed_gives_a_report_or_a_true_reason(fs_hz: float) -> None:
    read = []
    for seconds, rpm in itertools.product(SECONDS, SPEEDS_RPM):
        if round((seconds - 2 * END_S) * rpm / 60, 1) >= LEAST_REVOLUTIONS:
            found = gathered(outer_race(fs_hz, seconds, rpm)).analysis
            read.append([line.name for line in detected_fault_lines(found.lines)])
            assert read[-1] in ([], ["BPFO"]), (seconds, rpm)
            continue
        with pytest.raises(DataError, match=f"at least {LEAST_REVOLUTIONS} are needed") as refused:
            gathered(outer_race(fs_hz, seconds, rpm))
        wanted = re.search(r"Record at least ([\d.]+) s", str(refused.value))
        assert wanted
        if rpm in (300, 3000):
            assert gathered(outer_race(fs_hz, 1.01 * float(wanted[1]), rpm)).analysis.lines
    assert read.count(["BPFO"]) >= MOSTLY * len(read)
