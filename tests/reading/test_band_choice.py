import dataclasses

import numpy as np
import pytest

from srbval import Origin, analyse, load_bearing
from srbval.reading.lines import Line, sidak_corrected
from srbval.reading.pipeline import band_kurtogram, declared_band
from srbval.signal.comb import FALSE_ALARM
from tests.reading.test_analyse import BEARING, SHAFT_HZ, impulses, recording

ROUNDING, ROUNDING_PROBABILITY = 1e-6, 1e-12  # of two ways to compute one probability

OUTER = recording(impulses(BEARING.orders.bpfo * SHAFT_HZ))
NOISE = recording(np.random.default_rng(5).standard_normal(OUTER.samples))


def first_harmonics(analysis):
    return [x for x in analysis.lines if x.harmonic == 1 and x.noise_false_alarm is not None]


@pytest.mark.parametrize("record", [OUTER, NOISE], ids=["fault", "noise"])
def test_every_band_tried_on_the_record_counts_as_a_trial(record):
    chosen = analyse(record, bearing=BEARING, choose_on_record=True)
    assert chosen.band.trials in (2, 2 * band_kurtogram(record, BEARING, record.speed).kurtosis.size)
    assert str(chosen.band.trials) in chosen.to_dict()["band_choice"]["why"]
    given = analyse(record, bearing=BEARING, band_hz=chosen.processed.band_hz)
    assert given.band.trials == 1
    for dear, free in zip(first_harmonics(chosen), first_harmonics(given), strict=True):
        corrected = 1 - (1 - free.noise_false_alarm) ** chosen.band.trials
        assert dear.noise_false_alarm == pytest.approx(corrected, rel=ROUNDING, abs=ROUNDING_PROBABILITY)
        # The most impulsive band is chosen without regard to any comb, but between it and the whole the lines decide.
        ranked = free.placebo_false_alarm
        assert dear.placebo_false_alarm == (None if ranked is None else pytest.approx(1 - (1 - ranked) ** 2))
        assert (dear.false_alarm is None) == (ranked is None)


def test_one_loud_knock_does_not_hide_the_fault():
    """It makes some band the most impulsive one; in the whole band it is one event among hundreds."""
    samples = OUTER.channels["vibration"].copy()
    knock = np.arange(400) / OUTER.fs_hz
    samples[30_000:30_400] += 20 * samples.std() * np.exp(-600 * knock) * np.sin(2 * np.pi * 6000 * knock)
    knocked = recording(samples)
    impulsive = band_kurtogram(knocked, BEARING, knocked.speed).best_hz
    assert not analyse(knocked, bearing=BEARING, band_hz=impulsive).line("BPFO").detected
    chosen = analyse(knocked, bearing=BEARING, choose_on_record=True)
    assert chosen.line("BPFO").detected
    assert chosen.band.why.startswith("the whole band, ")


def test_a_line_that_the_trials_explain_is_no_longer_detected_nor_are_its_sidebands():
    line = Line(name="BPFI", harmonic=1, kinematic_hz=100.0, noise_false_alarm=0.2 * FALSE_ALARM, detected=True)
    side = dataclasses.replace(line, name="BPFI+fr", noise_false_alarm=1e-9)
    assert all(x.detected for x in sidak_corrected((line, side), 1))
    assert all(x.detected for x in sidak_corrected((line, side), 4))
    assert not any(x.detected for x in sidak_corrected((line, side), 6))


def test_a_simulated_record_of_a_larger_bearing_is_read_as_much_lower():
    usual = load_bearing("skf-22240")
    larger, smaller = (
        dataclasses.replace(
            usual,
            geometry=dataclasses.replace(
                usual.geometry, **{key: size * value for key, value in vars(usual.geometry).items() if key[-2:] == "_m"}
            ),
        )
        for size in (2, 0.5)
    )
    run = dataclasses.replace(OUTER, origin=Origin.SIMULATED, band_hz=None)
    assert declared_band(run, None, usual).band_hz == declared_band(run, None).band_hz == (500, 1500)
    assert declared_band(run, None, larger).band_hz == (250, 750)
    assert declared_band(run, None, smaller).band_hz == (500, 1500)
    assert "2 times as large" in declared_band(run, None, larger).why
    assert declared_band(run, (600, 900), larger).band_hz == (600, 900)
    assert declared_band(run, None, BEARING).band_hz == (500, 1500)  # a ball bearing's: not similar to the paper's
