"""The mistakes that this field's tools make, each made here on purpose beside what is done instead."""

import numpy as np
import pytest

from srbval.signal import (
    Periodogram,
    amplitude_spectrum,
    analytic_signal,
    bandpass,
    end_s,
    envelope,
    read_comb,
)
from tests.signal.test_comb import FS_HZ as COMB_FS_HZ
from tests.signal.test_comb import LINE_HZ, comb, read

FS_HZ, BAND_HZ, COUNT = 20_480.0, (1400.0, 2800.0), 61_440
END = round(end_s(BAND_HZ) * FS_HZ)
FIRST_MS = round(0.005 * FS_HZ)
TRIALS = 20
SNR_16_DB = 40.0
# What the two-step chain's Hilbert kernel carries beyond the dropped ends, as a share of the mean envelope.
BEYOND_ENDS = 5e-3
# The first 5 ms of an odd extension, wrong by tens of per cent.
SPOILT = 0.1
# 20 intervals, from noise alone (which covers few) and with slip (95 %, four standard errors).
MISSED, COVERED = 0.3, 0.8
# The paper's deviation, and the share of peaks in noise that lie within it: about one half.
PAPER_PCT, HALF_OF_THEM = 0.22, (0.25, 0.7)
# A fifth of a bin of 10 s: the peak is the shaft's eighth harmonic.
SAME_LINE_HZ = 0.02


def cut_from_a_longer_record(seed):
    long = np.random.default_rng(seed).standard_normal(3 * COUNT)
    return long[COUNT : 2 * COUNT], np.abs(analytic_signal(long, FS_HZ, BAND_HZ))[COUNT : 2 * COUNT]


def test_odd_padding_spoils_the_first_milliseconds_and_dropping_the_ends_takes_all_of_that():
    """Envelope over the first 5 ms, in its own mean: tens of per cent; beyond what is dropped nothing."""
    wrong = []
    for seed in range(10):
        record, truth = cut_from_a_longer_record(seed)
        found = envelope(bandpass(record, FS_HZ, BAND_HZ))
        wrong.append(np.sqrt(np.mean((found - truth)[:FIRST_MS] ** 2)) / truth.mean())
        assert np.abs(found - truth)[END:-END].max() < BEYOND_ENDS * truth.mean()
    assert np.median(wrong) > SPOILT


def test_the_highest_bin_is_ten_times_worse_than_the_joint_fit():
    highest, joint = [], []
    rng = np.random.default_rng(10)
    for line_hz in LINE_HZ + rng.uniform(-0.05, 0.05, TRIALS):  # anywhere between two bins
        samples = comb(rng, 10.0, snr=SNR_16_DB, line_hz=line_hz)
        spectrum = amplitude_spectrum(samples, COMB_FS_HZ)
        near = np.abs(spectrum.frequency_hz - LINE_HZ) < 0.005 * LINE_HZ
        highest.append(spectrum.frequency_hz[near][np.argmax(spectrum.amplitude[near])] - line_hz)
        joint.append(read(samples).found_hz - line_hz)
    assert np.sqrt(np.mean(np.square(highest))) > 8 * np.sqrt(np.mean(np.square(joint)))


def test_an_interval_from_noise_alone_misses_a_slipping_line():
    rng = np.random.default_rng(11)
    kept = [read(comb(rng, 10.0, 0.01, SNR_16_DB)) for _ in range(TRIALS)]
    error = np.array([abs(r.found_hz - LINE_HZ) for r in kept])
    assert np.mean(error < [r.noise_ci95_hz for r in kept]) < MISSED
    assert np.mean(error < [r.ci95_hz for r in kept]) > COVERED


def test_a_peak_is_always_found_near_enough_to_look_like_agreement_and_is_not_a_detection():
    rng = np.random.default_rng(12)
    half = 0.005 * LINE_HZ
    found = []
    for _ in range(60):
        record = Periodogram.of(3 + rng.standard_normal(20_000), COMB_FS_HZ, limit_hz=520.0, shaft_hz=71 / 6)
        found.append(read_comb(record, LINE_HZ, half))
    deviations = np.array([100 * abs(r.found_hz / LINE_HZ - 1) for r in found if r is not None])
    assert deviations.size > 50
    assert HALF_OF_THEM[0] < np.mean(deviations < PAPER_PCT) < HALF_OF_THEM[1], (
        "the paper's 0.22 % is met by noise about every other time"
    )
    assert not any(r.detected for r in found if r is not None)


def test_wide_windows_take_a_shaft_harmonic_for_a_fault_line():
    """Eight times the shaft lies 2.2 % below BPFO: masked, and outside a capped window besides."""
    shaft_hz = LINE_HZ / 8.1794
    time_s = np.arange(20_000) / COMB_FS_HZ
    samples = 3 + np.cos(2 * np.pi * 8 * shaft_hz * time_s) + 0.3 * np.random.default_rng(13).standard_normal(20_000)
    wide = 0.03 * LINE_HZ
    blind = Periodogram.of(samples, COMB_FS_HZ, limit_hz=520.0, shaft_hz=400.0)  # no harmonic of this one is near
    taken = read_comb(blind, LINE_HZ, wide)
    assert taken is not None
    assert taken.found_hz == pytest.approx(8 * shaft_hz, abs=SAME_LINE_HZ)
    assert taken.detected
    for record, half in ((Periodogram.of(samples, COMB_FS_HZ, limit_hz=520.0, shaft_hz=shaft_hz), wide),
                         (blind, 0.01 * LINE_HZ)):  # fmt: skip
        reading = read_comb(record, LINE_HZ, half)
        assert reading is None or not reading.detected
