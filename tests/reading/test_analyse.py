import numpy as np
import pytest

from srbval import ConfigurationError, DataError, Origin, Recording, ShaftSpeed, SpeedSource, analyse, load_bearing

SIDEBAND_HZ = 0.05  # a fifth of a bin of four seconds: sidebands are read one by one
HARMONIC_RELATIVE = 1e-3  # harmonics are read one by one, by a quarter of a bin at the first
SAME_CHAIN_HZ = 1e-6  # the same samples but for rounding of the two axes

FS_HZ = 20_480.0
SECONDS = 4.0
SHAFT_HZ = 14.3
BEARING = load_bearing("skf-22240")
# Strong impulses without slip: the reading is limited by the sampling of their times only.
READING_PCT = 0.02


def impulses(rate_hz, *, modulation_hz=0.0, depth=0.8, seed=1, noise=0.3):
    """Impulses at `rate_hz` ringing at 2 kHz, their size modulated at `modulation_hz`, and noise."""
    times_s = np.arange(0.01, SECONDS - 0.02, 1 / rate_hz)
    sizes = 1 + depth * np.cos(2 * np.pi * modulation_hz * times_s) if modulation_hz else np.ones(times_s.size)
    return rings(times_s, sizes, seed, noise)


def rings(times_s, sizes, seed=1, noise=0.3):
    """Rings at 2 kHz in noise."""
    samples = noise * np.random.default_rng(seed).standard_normal(round(SECONDS * FS_HZ))
    ring_s = np.arange(200) / FS_HZ
    ring = np.exp(-ring_s * 1500) * np.sin(2 * np.pi * 2000 * ring_s)
    for at_s, size in zip(times_s, sizes, strict=True):
        first = round(at_s * FS_HZ)
        samples[first : first + ring.size] += 3 * size * ring[: samples.size - first]
    return samples


def recording(samples, **changes):
    values = {
        "name": "made up",
        "origin": Origin.MEASURED,
        "channels": {"vibration": samples},
        "channel": "vibration",
        "fs_hz": FS_HZ,
        "unit": "m/s2",
        "speed": ShaftSpeed(value_hz=SHAFT_HZ, ci95_hz=0.002, source=SpeedSource.TACHOMETER),
        "band_hz": (1400.0, 2800.0),
        "file": "made_up.mat",
    }
    return Recording(**(values | changes))


@pytest.fixture(scope="module")
def outer():
    return analyse(recording(impulses(BEARING.orders.bpfo * SHAFT_HZ * 1.002)), bearing=BEARING)


@pytest.fixture(scope="module")
def inner():
    samples = impulses(BEARING.orders.bpfi * SHAFT_HZ * 0.999, modulation_hz=SHAFT_HZ)
    return analyse(recording(samples), bearing=BEARING)


def both_races():
    outer_hz = BEARING.orders.bpfo * SHAFT_HZ * 0.998
    samples = impulses(outer_hz) + impulses(19 * SHAFT_HZ - outer_hz, seed=3)
    return analyse(recording(samples), bearing=BEARING)


def detected(analysis):
    return {line.name for line in analysis.lines if line.detected and line.harmonic == 1}


def test_outer_race_line_is_found_where_it_is(outer):
    line = outer.line("BPFO")
    assert line.detected
    assert line.deviation_pct == pytest.approx(0.2, abs=READING_PCT)
    assert outer.summary.startswith("BPFO (outer race) line detected")
    assert not {"BPFI", "2xBSF"} & detected(outer)


def test_inner_race_line_is_found_with_its_sidebands(inner):
    assert inner.line("BPFI").deviation_pct == pytest.approx(-0.1, abs=READING_PCT)
    assert {"BPFI", "BPFI-fr", "BPFI+fr"} <= detected(inner)
    assert inner.summary.startswith("BPFI (inner race) line detected")
    found = inner.line("BPFI").found_hz
    assert inner.line("BPFI+fr").found_hz == pytest.approx(found + SHAFT_HZ, abs=SIDEBAND_HZ)
    assert inner.line("BPFI-fr").found_hz == pytest.approx(found - SHAFT_HZ, abs=SIDEBAND_HZ)


def test_every_harmonic_in_reach_is_a_line_of_its_own(outer):
    harmonics = [line for line in outer.lines if line.name == "BPFO"]
    assert [line.harmonic for line in harmonics] == [1, 2, 3, 4, 5]
    for line in harmonics:
        assert line.kinematic_hz == pytest.approx(line.harmonic * BEARING.orders.bpfo * SHAFT_HZ)
        assert line.found_hz == pytest.approx(line.harmonic * outer.line("BPFO").found_hz, rel=HARMONIC_RELATIVE)


def test_second_harmonic_of_a_slower_comb_is_no_race_line():
    samples = impulses(BEARING.orders.bpfo * SHAFT_HZ * 1.002 / 2)
    line = analyse(recording(samples), bearing=BEARING).line("BPFO")
    assert not line.detected
    assert "half" in line.explained_by


def test_simulated_axes_go_through_the_same_chain_as_a_sensor_between_them(outer):
    samples = outer.recording.channels["vibration"]
    axes = {"y": samples / np.sqrt(2), "z": samples / np.sqrt(2)}
    run = recording(samples, channels=axes, channel=None, axes=("y", "z"), origin=Origin.SIMULATED)
    result = analyse(run, bearing=BEARING)
    assert result.line("BPFO").found_hz == pytest.approx(outer.line("BPFO").found_hz, abs=SAME_CHAIN_HZ)
    np.testing.assert_allclose(result.processed.envelope, outer.processed.envelope, rtol=1e-6, atol=1e-9)


def test_two_to_three_ratio_of_a_stronger_line_is_not_a_second_fault():
    bearing = load_bearing("skf-6205")
    shaft_hz = 29.95
    speed = ShaftSpeed(value_hz=shaft_hz, ci95_hz=0.01, source=SpeedSource.STATED)
    line_hz = bearing.orders.bpfo * shaft_hz * 1.003
    # Every other impulse weaker: half-order lines, the third of them inside the window of BPFI.
    samples = impulses(line_hz, modulation_hz=line_hz / 2, depth=0.2)
    result = analyse(recording(samples, speed=speed), bearing=bearing)
    assert result.line("BPFO").detected
    assert result.line("BPFI").explained_by == "3/2 BPFO"
    assert not result.line("BPFI").detected


def test_both_race_lines_close_on_the_number_of_rollers():
    closure = both_races().closure
    assert closure["expected_hz"] == pytest.approx(19 * SHAFT_HZ)
    assert closure["difference_pct"] == pytest.approx(0.0, abs=2 * READING_PCT)
    assert closure["closed"]


@pytest.mark.parametrize(
    ("changes", "options", "error", "says"),
    [
        ({"speed": None}, {}, ConfigurationError, "--rpm"),
        ({"band_hz": None}, {}, ConfigurationError, "--band"),
        ({}, {"band_hz": (5000.0, 11_000.0)}, ConfigurationError, "Nyquist"),
        ({"channels": {"vibration": np.full(20_000, 9.81)}}, {}, DataError, "constant"),
        ({"channels": {"vibration": impulses(100.0)[:3000]}}, {}, DataError, "revolutions"),
    ],
)
def test_what_cannot_be_analysed_is_refused_with_a_remedy(changes, options, error, says):
    with pytest.raises(error, match=says):
        analyse(recording(impulses(100.0), **changes), bearing=BEARING, **options)
