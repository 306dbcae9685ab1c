"""Amplitudes: levels of known tones, increments, patterns of known modulation, and rows with their verdicts."""

import dataclasses
import math

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.comparison.comparison import RIG_READING, ComparisonVerdict, QuantityValue
from srbval.errors import DataError
from srbval.path.amplitudes import THIRD_OCTAVES, kurtoses, levels, pattern
from srbval.recordings import Origin, Recording
from srbval.studies.rig_amplitudes import NUMERICS, PATH, crps, half_widths, kind_of, rows, scaling, with_background
from srbval.studies.simulated_rig import BEARING, FS_HZ, LINE_HZ, SECONDS, SHAFT_HZ, background, record_of

TIME_S = np.arange(round(SECONDS * FS_HZ)) / FS_HZ
NEAR_DB = 0.01  # of a tone in the middle of its band
BIAS_DB = 0.5
ORDER = BEARING.orders.bpfo


def made(samples: np.ndarray, state: Fault = Fault.OUTER) -> Recording:
    return dataclasses.replace(record_of("made", state, samples), origin=Origin.STAND_IN)


def test_a_tone_has_its_level_in_its_third_octave_alone() -> None:
    found = levels(made(2.0 * np.sin(2 * math.pi * THIRD_OCTAVES["1000 Hz"] * TIME_S)), None)
    assert found["1000 Hz"].value == pytest.approx(10 * math.log10(2.0), abs=NEAR_DB)
    assert max(value.value for name, value in found.items() if name in THIRD_OCTAVES and name != "1000 Hz") < -20
    assert found["RMS 500-1500 Hz"].value == pytest.approx(10 * math.log10(2.0), abs=NEAR_DB)


def test_an_increment_is_what_a_fault_adds_and_is_known_as_well_as_it_says() -> None:
    errors, inside = [], []
    for seed in range(40):
        random = np.random.default_rng(seed)
        tone = 0.05 * np.sin(2 * math.pi * 1000 * TIME_S)
        noise = [0.3 * random.standard_normal(TIME_S.size) for _ in range(2)]
        value = levels(made(tone + noise[0]), made(noise[1], Fault.HEALTHY))["1000 Hz"]
        errors.append(value.value - 10 * math.log10(0.05**2 / 2))
        inside.append(abs(errors[-1]) <= (value.ci95 or 0.0))
    assert abs(np.mean(errors)) < BIAS_DB
    assert np.mean(inside) > 0.85  # of 40; 34 is the least that 95 % make likely


def test_the_pattern_of_a_known_modulation() -> None:
    """(1 + m cos)^2 = 1 + m^2 / 2 + 2 m cos + m^2 / 2 cos 2: lines 2 m and m^2 / 2 over the mean 1 + m^2 / 2."""
    depth = 0.4
    carrier = np.sin(2 * math.pi * 2100 * TIME_S)
    random = np.random.default_rng(1)
    noise = 1e-4 * random.standard_normal(TIME_S.size)
    found = pattern(
        made((1 + depth * np.cos(2 * math.pi * LINE_HZ * TIME_S)) * carrier + noise), BEARING, Fault.OUTER, ORDER
    )
    assert found["depth"].value == pytest.approx(100 * 2 * depth / (1 + depth**2 / 2), rel=0.01)
    assert found["harmonic 2"].value == pytest.approx(20 * math.log10(depth / 4), abs=0.1)
    assert not found["harmonic 5"].present
    assert "sidebands 1" not in found  # an outer-race fault stands still in the load zone


def test_sidebands_of_a_fault_that_passes_the_load_zone() -> None:
    line_hz = BEARING.orders.bpfi * SHAFT_HZ
    modulation = (1 + 0.5 * np.cos(2 * math.pi * SHAFT_HZ * TIME_S)) * np.cos(2 * math.pi * line_hz * TIME_S)
    samples = np.sqrt(2 + modulation) * np.sin(2 * math.pi * 2100 * TIME_S)  # its square is the modulation
    noise = 1e-3 * np.random.default_rng(2).standard_normal(TIME_S.size)
    found = pattern(made(samples + noise, Fault.INNER), BEARING, Fault.INNER, BEARING.orders.bpfi)
    assert found["sidebands 1"].value == pytest.approx(20 * math.log10(0.25), abs=0.1)
    assert found["sidebands 2"].value < -30


def test_gaussian_noise_has_a_kurtosis_of_three_and_adds_nothing() -> None:
    one, other = (made(np.random.default_rng(seed).standard_normal(TIME_S.size)) for seed in (3, 4))
    value = kurtoses(one)["kurtosis 1400-2800 Hz"]
    assert abs(value.value - 3.0) < 2 * (value.ci95 or 0.0)
    assert 0 < (value.ci95 or 0.0) < 0.4
    assert sum(value.present for value in levels(one, other).values()) <= 1
    louder = dataclasses.replace(one, channels={"a": 1.4 * one.channels["a"]})
    shown = [sum(value.present for value in levels(louder, other, mounting_db).values()) for mounting_db in (0.0, 2.0)]
    assert shown[0] > 10
    assert shown[1] == 0, "twice the power of another mounting is nothing that a fault must have added"
    with pytest.raises(DataError, match="no shaft speed"):
        pattern(dataclasses.replace(one, speed=None), BEARING, Fault.OUTER, ORDER)


def test_a_background_keeps_its_levels_and_nothing_else() -> None:
    noise = made(background(np.random.default_rng(4), 0.1), Fault.HEALTHY)
    quiet = made(np.zeros(TIME_S.size))
    both = with_background(quiet, noise)
    for name, value in levels(both, None).items():
        assert value.value == pytest.approx(levels(noise, None)[name].value, abs=1.0)
    assert not np.allclose(both.channels["sensor"], noise.channels["a"], atol=0.01)


def test_rows_have_every_part_and_a_verdict() -> None:
    rig = {"1000 Hz": QuantityValue(value=-20.0, ci95=0.5), "depth": QuantityValue(value=50.0, ci95=1.0),
           "501 Hz": QuantityValue(value=-20.0)}  # fmt: skip
    model = {"1000 Hz": QuantityValue(value=-20.5), "depth": QuantityValue(value=40.0)}
    parts = {PATH: {"1000 Hz": 0.98}, NUMERICS: {"1000 Hz": 0.3, "depth": 2.0}}
    level, depth = rows(rig, model, parts, record="IR", fault=Fault.INNER, used_for="withheld")
    assert level.parts == pytest.approx({RIG_READING: 0.5, PATH: 0.98, NUMERICS: 0.3})
    assert (level.kind, level.error, level.verdict) == ("band level", -0.5, ComparisonVerdict.AGREES)
    assert (depth.kind, depth.error) == ("modulation depth", pytest.approx(100 * math.log(0.8)))
    assert depth.parts == pytest.approx({RIG_READING: 2.0, NUMERICS: 4.0})
    assert depth.verdict is ComparisonVerdict.RESOLVED  # 20 % off, known to 4.5 %
    assert level.to_dict()["used_for"] == "withheld"


def test_the_cage_ratio_has_its_own_margin() -> None:
    sides = ({"cage ratio": QuantityValue(value=value)} for value in (0.43082, 0.43090))
    (row,) = rows(*sides, {NUMERICS: {"cage ratio": 1e-4}}, record="OR", fault=Fault.OUTER, used_for="withheld")
    assert (row.kind, row.margin) == ("line frequency", 0.1)
    assert row.error == pytest.approx(0.0186, rel=0.01)  # per cent
    assert row.verdict is ComparisonVerdict.AGREES


def test_a_level_that_rises_with_the_speed() -> None:
    slow = {"1000 Hz": QuantityValue(value=-30.0, ci95=0.3), "501 Hz": QuantityValue(value=-40.0, present=False)}
    fast = {"1000 Hz": QuantityValue(value=-18.0, ci95=0.4), "501 Hz": QuantityValue(value=-30.0)}
    found = scaling(slow, fast)
    assert found["scaling 1000 Hz"] == QuantityValue(value=12.0, ci95=pytest.approx(0.5))
    assert not found["scaling 501 Hz"].present
    assert kind_of("scaling 1000 Hz") == "speed scaling"


def test_half_widths_are_student_s() -> None:
    """t(3) = 3.1824 (Student's table) times the standard deviation of four draws."""
    found = half_widths([{"a": value} for value in (1.0, 2.0, 3.0, 4.0)])
    assert found["a"] == pytest.approx(3.1824 * np.std([1, 2, 3, 4], ddof=1), rel=1e-4)


def test_the_score_is_the_integral_that_defines_it() -> None:
    """CRPS = integral of (F(x) - 1(x >= y))^2 over x."""
    error, u = 1.7, 0.8
    x = np.linspace(-12, 12, 200_001)
    below = 0.5 * (1 + np.array([math.erf(one / (u * math.sqrt(2))) for one in x - error]))
    assert crps(error, u) == pytest.approx(float(np.trapezoid((below - (x >= 0)) ** 2, x)), rel=1e-4)
    assert crps(-error, u) == pytest.approx(crps(error, u))
    assert crps(-2.0, 0.0) == 2.0
