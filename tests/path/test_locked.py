"""Power locked to a fault in third octaves, and lines that are no fault's taken out, on records of known truth."""

from dataclasses import replace

import numpy as np
import pytest

from srbval import ConfigurationError, Recording
from srbval.bearing import Fault
from srbval.path.amplitudes import LEVEL_BANDS, WHOLE_HZ, locked_levels
from srbval.path.locked import PASSAGE_LINES, locked_powers, without_passage_lines
from tests.path.test_path import BEARING, FS_HZ, LINE_HZ, ORDER, SHAFT_HZ, TIME_S, background, record_of
from tests.path.test_path import pulses as ring_pulses
from tests.signal.test_envelope import bandpass

BAND, WIDE = "1585 Hz", "3162 Hz"  # that of 15 x BPFO at 877 rpm; one that hardly smears a passage
NEAR_DB = 1.0  # twice the scatter of a band of noise over 2 s


def gated(random: np.random.Generator, rms: float) -> np.ndarray:
    """Noise within the band, all of its power in three tenths of the passage's phase."""
    noise = bandpass(random.standard_normal(TIME_S.size), FS_HZ, (2950.0, 3400.0))
    gated = noise * (LINE_HZ * TIME_S % 1.0 < 0.3)
    return rms * gated / gated.std()


def pulses(random: np.random.Generator) -> np.ndarray:
    """Half a millisecond of force once per passage, with slip of 0.3 % of the spacing."""
    return -ring_pulses(random, Fault.OUTER)[:, 1]


def tone(amplitude: float) -> np.ndarray:
    return amplitude * np.sin(2 * np.pi * 15 * LINE_HZ * TIME_S)


def locked(samples: np.ndarray, band: str = BAND) -> float:
    powers = locked_powers(record_of("made", Fault.OUTER, samples), BEARING, ORDER, LEVEL_BANDS)
    return 10 * np.log10(powers[band].value)


def cleaned(samples: np.ndarray, state: Fault = Fault.OUTER, order: float | None = ORDER) -> Recording:
    return without_passage_lines(record_of("made", state, samples), BEARING, order, WHOLE_HZ)


def test_a_known_power_is_found_whatever_the_background():
    random = np.random.default_rng(1)
    fault = gated(random, 0.2)
    assert locked(fault, WIDE) == pytest.approx(20 * np.log10(0.2), abs=NEAR_DB)
    assert locked(fault + background(random, 0.2), WIDE) == pytest.approx(locked(fault, WIDE), abs=NEAR_DB)
    assert locked(2 * fault, WIDE) == pytest.approx(locked(fault, WIDE) + 20 * np.log10(2))


def test_bands_that_cannot_show_the_line_are_left_out():
    found = locked_powers(record_of("made", Fault.OUTER, pulses(np.random.default_rng(2))), BEARING, ORDER, LEVEL_BANDS)
    assert list(found) == ["1259 Hz", "1585 Hz", "1995 Hz", "2512 Hz", "3162 Hz"]  # wider than 2 x 117 Hz
    with pytest.raises(ConfigurationError, match="no shaft speed"):
        locked_powers(replace(record_of("x", Fault.OUTER, TIME_S), speed=None), BEARING, ORDER, LEVEL_BANDS)


def test_a_line_that_is_no_fault_s_does_not_count():
    random = np.random.default_rng(3)
    quiet = tone(1.0) + background(random, 0.05)
    assert not locked_levels(record_of("made", Fault.OUTER, quiet), BEARING, ORDER)[f"locked {BAND}"].present
    fault = pulses(random)
    with_line = fault + tone(1.0)
    assert locked(cleaned(with_line).channels["sensor"]) == pytest.approx(locked(fault), abs=0.05)
    assert abs(locked(with_line) - locked(fault)) > 0.4, "left in it interferes with the passages"


def test_the_line_is_taken_out_and_the_fault_s_own_harmonic_stays():
    random = np.random.default_rng(4)
    fault = pulses(random) + background(random, 0.01)
    for with_line in (fault, fault + tone(2.0)):
        assert (cleaned(with_line).channels["sensor"] - fault).std() < 0.02 * fault.std()


def test_a_healthy_bearing_has_its_own_multiples():
    noise = background(np.random.default_rng(5), 0.05)
    for multiple in (*PASSAGE_LINES[True], *PASSAGE_LINES[False]):
        hz = multiple * ORDER * SHAFT_HZ * 1.001  # the cage slips
        line = 0.3 * np.sin(2 * np.pi * hz * TIME_S)
        left = cleaned(noise + line, Fault.HEALTHY, None).channels["sensor"] - noise
        inside = multiple in PASSAGE_LINES[True] and hz < WHOLE_HZ[1]
        assert (left.std() < 0.1 * line.std()) == inside
