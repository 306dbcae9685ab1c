"""The path to the sensor, identified on simulated truth; amplitudes of tones, levels and patterns of planted errors."""

import math
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.signal
from scipy.special import chdtrc, ndtr

from srbval import ConfigurationError, DataError, Origin, Recording, load_scene
from srbval.arrays import FloatArray
from srbval.bearing import Fault, load_bearing
from srbval.models import outputs
from srbval.models.run import Run
from srbval.models.sensor import SensorFilter
from srbval.models.simulate import Step, simulate
from srbval.path import amplitudes
from srbval.path import identify as module
from srbval.path.amplitudes import LEVEL_BANDS, level_and_pattern, levels, mounting_scatter, pattern
from srbval.path.identify import Pair, default_band, identify, join_bands, third_octaves
from srbval.recordings import ShaftSpeed, SpeedSource
from srbval.recordings.registry import recording_of
from srbval.scene import SensorPath

FS_HZ, SECONDS, SHAFT_HZ = 20480.0, 2.0, 14.3
BEARING = load_bearing("skf-22240")
LINE_HZ = BEARING.orders.bpfo * SHAFT_HZ
GAINS = (0.5, 0.7, 1.0, 1.8, 1.2, 0.9, 2.0, 1.4, 0.8, 0.6)  # of third octaves from 398 to 3162 Hz
RATIO = 4.0  # of cross to load
MIDDLES_HZ = tuple(10 ** (n / 10) for n in range(26, 36))
TRUE = SensorPath(frequency_hz=MIDDLES_HZ, load=GAINS, cross=tuple(RATIO * one for one in GAINS), source="known")
NEAR_TRUE_DB = 0.2  # of gains: pulses here are far above the noise
BIAS = 0.05  # of the ratio: what slip of a few tenths of a per cent takes from the sidebands
BAND_HZ = (400.0, 3150.0)


def simulated_pair(seed: int, state: Fault, *, noise: float = 0.02) -> Pair:
    """A record behind the path `TRUE`, and a run with pulses that differ from the record's in phase and slip alone."""
    random = np.random.default_rng(seed)
    record = record_of(state.code, state, behind(pulses(random, state), TRUE) + background(random, noise))
    return Pair(record=record, run=run_with(state, pulses(random, state)))


def pulses(random: np.random.Generator, state: Fault) -> FloatArray:
    """Accelerations [n, 3] of a ring with one pulse per passage and slip of 0.3 % of the spacing.

    A defect of the inner race turns through the load zone, which reaches 90 degrees to either side.
    """
    rate_hz = state.line_order(BEARING.orders) * SHAFT_HZ
    times = random.uniform(0, 1 / rate_hz) + np.cumsum(1 + 0.003 * random.standard_normal(400)) / rate_hz
    times = times[times < SECONDS]
    angle = 2 * math.pi * SHAFT_HZ * times if state is Fault.INNER else np.zeros(times.size)
    strength = np.maximum(np.cos(angle), 0.0)
    train = np.zeros((round(SECONDS * FS_HZ), 3))
    at = (times * FS_HZ).astype(int)
    train[at, 0], train[at, 1] = strength * np.sin(angle), -strength * np.cos(angle)  # the load pushes along -y
    shape = 30 * np.diff(scipy.signal.windows.hann(9))  # a force of half a millisecond, as a change of velocity
    return scipy.signal.oaconvolve(train, shape[:, None], axes=0)[: len(train)]


def background(random: np.random.Generator, noise: float) -> FloatArray:
    """Noise behind the path."""
    return behind(noise * random.standard_normal((round(SECONDS * FS_HZ), 3)), replace(TRUE, cross=TRUE.load))


def behind(acceleration: FloatArray, path: SensorPath) -> FloatArray:
    """Signal [n] of a sensor behind the path, from the accelerations [n, 3] of a ring under a load along -y."""
    return SensorFilter(path, FS_HZ, -math.pi / 2).add(acceleration)


def record_of(name: str, state: Fault, samples: FloatArray) -> Recording:
    """A record of one channel whose samples are means over their intervals, as those of a run."""
    speed = ShaftSpeed(value_hz=SHAFT_HZ, ci95_hz=0.001, source=SpeedSource.TACHOMETER)
    own = {"name": name, "state": state, "speed": speed, "channels": {"a": samples}, "channel": "a"}
    return Recording(origin=Origin.SIMULATED, interval_means=True, fs_hz=FS_HZ, unit="m/s2", **own)


@cache
def _rolling(state: Fault) -> Run:
    changes = {"defect": {"kind": state}, "shaft_speed": f"{60 * SHAFT_HZ} rpm", "duration": f"{SECONDS} s"}
    return simulate(load_scene("rig", {"model": "kinematic"} | changes), step=Step.UNCHECKED)


def run_with(state: Fault, acceleration: FloatArray) -> Run:
    """A run of pure rolling with these accelerations of its ring, [n, 3]."""
    run = _rolling(state)
    out = run.out.copy()
    out[:, outputs.ACCELERATION_XYZ] = acceleration
    return replace(run, out=out)


@pytest.fixture(scope="module")
def rig():
    """An outer-race and an inner-race fault, each with the run that drives its path."""
    return SimpleNamespace(outer=simulated_pair(1, Fault.OUTER), inner=simulated_pair(2, Fault.INNER))


@pytest.fixture(scope="module")
def found(rig):
    return identify(rig.outer, rig.inner, bearing=BEARING)


def test_a_known_path_is_found_in_both_directions(found):
    path = found.path
    true = np.abs(TRUE.response(np.array(path.frequency_hz)))
    off_db = 20 * np.log10(np.array(path.load) / true[0])
    assert path.frequency_hz[0] == pytest.approx(501, abs=1)  # joined with 631 Hz; 398 Hz alone is too narrow
    assert path.frequency_hz[-1] == pytest.approx(3162, abs=1)
    assert off_db[4:] == pytest.approx(0.0, abs=NEAR_TRUE_DB)
    assert (path.load[0], path.load[2]) == (path.load[1], path.load[3])  # third octaves below 1259 Hz are joined
    assert np.all(np.abs(off_db[:4]) < 2 * np.array(path.u_db[:4]))
    assert min(path.u_db[:4]) > np.std(20 * np.log10(GAINS[1:])) / 2
    assert path.cross[0] / path.load[0] == pytest.approx(RATIO, rel=BIAS)
    assert abs(20 * np.log10(path.cross[0] / path.load[0] / RATIO)) < 2 * path.cross_u_db
    assert path.used == ("OR", "IR (direction)")


def test_third_octaves_are_joined_downwards_until_they_hold_two_spacings():
    """Edges by hand: 10^2.65 = 446.7, 10^2.85 = 707.9, 10^3.05 = 1122 Hz; 261 and 414 Hz are wide enough, 92 is not."""
    bands = join_bands(third_octaves(BAND_HZ), 234.0)
    assert [edge for low_high in list(bands.values())[:3] for edge in low_high] == pytest.approx(
        [446.7, 707.9, 707.9, 1122.0, 1122.0, 1412.5], abs=0.1
    )
    assert list(bands)[:3] == pytest.approx([501.2, 794.3, 1258.9], abs=0.1)
    assert join_bands(third_octaves(BAND_HZ), 90.0) == third_octaves(BAND_HZ)
    assert join_bands(third_octaves(BAND_HZ), 4000.0) == {}


def test_sidebands_of_the_inner_race_alone_determine_the_ratio(rig):
    alone = identify(rig.inner, bearing=BEARING).path
    assert alone.cross[0] / alone.load[0] == pytest.approx(RATIO, rel=BIAS)
    assert alone.used == ("IR", "IR (direction)")
    outer = identify(rig.outer, bearing=BEARING)
    assert outer.path.cross == outer.path.load
    assert outer.sidebands_db is None
    assert identify(rig.outer, bearing=BEARING, band_hz=BAND_HZ).path == outer.path


def test_without_a_band_the_path_ends_where_the_slowest_record_does(rig):
    slow = replace(rig.outer.record, fs_hz=4096.0)
    low, high = default_band([rig.outer.record, slow])
    assert (low, max(third_octaves((low, high)))) == (400.0, pytest.approx(1585, rel=0.01))


def test_the_power_of_a_healthy_record_at_the_passage_is_subtracted(rig, found):
    """A healthy record with half of the faulty one's amplitude has a quarter of its power: sqrt(3/4) of the gains."""
    samples = {"a": 0.5 * rig.outer.record.channels["a"]}
    healthy = replace(rig.outer.record, name="H", state=Fault.HEALTHY, channels=samples)
    less = identify(rig.outer, rig.inner, bearing=BEARING, healthy=healthy).path
    assert np.array(less.load) / found.path.load == pytest.approx(0.75**0.5, rel=0.01)


def test_noisy_gains_scatter_as_their_uncertainty_states():
    """Over rigs, with a background as strong as the pulses behind the path."""
    pairs = [simulated_pair(seed, Fault.OUTER, noise=3.0) for seed in range(5, 15)]
    paths = [identify(pair, bearing=BEARING, band_hz=(1200.0, 3200.0)).path for pair in pairs]
    off, u = [], []
    for path in paths:
        true = np.abs(TRUE.response(np.array(path.frequency_hz))[0])
        off += (20 * np.log10(np.array(path.load) / true)).tolist()
        u += path.u_db
    assert 0.6 < np.std(off) / np.sqrt(np.mean(np.square(u))) < 1.4  # 10 rigs of five bands


def test_the_bundled_path_is_what_the_rigs_two_records_give(recordings_dir):
    files = [str(recordings_dir / "torino" / f"{name}_877rpm_sample.mat") for name in ("OR", "IR")]
    pairs = [Pair(record=one, run=module.simulated_run(one, load_scene("rig"))) for one in map(recording_of, files)]
    bundled, own = load_scene("rig", {"sensor_path": "rig"}).sensor_path, identify(*pairs, bearing=BEARING).path
    assert bundled is not None
    for name in ("load", "cross", "u_db"):
        assert getattr(own, name) == pytest.approx(getattr(bundled, name), rel=0.01)


def test_records_that_cannot_be_used_are_refused(rig):
    def changed(**changes: object) -> Pair:
        return replace(rig.outer, record=replace(rig.outer.record, **changes))

    for pair, error, said in (
        (changed(unit="g"), DataError, "m/s2 is needed"),
        (changed(state=Fault.HEALTHY), ConfigurationError, "--defect"),
        (changed(speed=None), ConfigurationError, "--rpm"),
        (changed(channels={"a": np.random.default_rng(1).standard_normal(40960)}), DataError, "Widen --band"),
    ):
        with pytest.raises(error, match=said):
            identify(pair, bearing=BEARING)
    for band_hz in ((400.0, 12_000.0), (3000.0, 400.0), (1050.0, 1100.0)):
        with pytest.raises(ConfigurationError, match="contain the centre frequency of a third octave"):
            identify(rig.outer, bearing=BEARING, band_hz=band_hz)
    with pytest.raises(DataError, match="inner-race fault"):
        identify(rig.outer, rig.outer, bearing=BEARING)


TIME_S = np.arange(round(SECONDS * FS_HZ)) / FS_HZ
NEAR_DB = 0.01  # of a tone in the middle of its band
BIAS_DB = 0.5
ORDER = BEARING.orders.bpfo
BANDS, COMMON_DB, OWN_DB, TRIALS = 6, 6.0, 1.0, 400  # of planted errors
COVARIANCE = COMMON_DB**2 * np.ones((BANDS, BANDS)) + OWN_DB**2 * np.eye(BANDS)


def made(samples: np.ndarray, state: Fault = Fault.OUTER) -> Recording:
    return replace(record_of("made", state, samples), origin=Origin.STAND_IN)


def test_a_tone_has_its_level_in_its_third_octave_alone():
    found = levels(made(2.0 * np.sin(2 * math.pi * 1000.0 * TIME_S)), None)
    assert found["1000 Hz"].value == pytest.approx(10 * math.log10(2.0), abs=NEAR_DB)
    assert max(value.value for name, value in found.items() if name in LEVEL_BANDS and name != "1000 Hz") < -20
    assert found["RMS 500-1500 Hz"].value == pytest.approx(10 * math.log10(2.0), abs=NEAR_DB)


def test_the_increment_is_the_power_of_the_fault_and_its_interval_covers_it():
    errors, inside = [], []
    for seed in range(40):
        random = np.random.default_rng(seed)
        one, other = (0.3 * random.standard_normal(TIME_S.size) for _ in range(2))
        tone = 0.05 * np.sin(2 * math.pi * 1000 * TIME_S)
        value = levels(made(tone + one), made(other, Fault.HEALTHY))["1000 Hz"]
        errors.append(value.value - 10 * math.log10(0.05**2 / 2))
        inside.append(abs(errors[-1]) <= value.ci95)
    assert abs(np.mean(errors)) < BIAS_DB
    assert np.mean(inside) > 0.85  # of 40; 34 is the least that 95 % make likely


def test_the_pattern_of_a_known_modulation():
    """(1 + m cos)^2 = 1 + m^2 / 2 + 2 m cos + m^2 / 2 cos 2: lines 2 m and m^2 / 2 over the mean 1 + m^2 / 2."""
    depth = 0.4
    modulated = (1 + depth * np.cos(2 * math.pi * LINE_HZ * TIME_S)) * np.sin(2 * math.pi * 2100 * TIME_S)
    noise = 1e-4 * np.random.default_rng(1).standard_normal(TIME_S.size)
    found = pattern(made(modulated + noise), BEARING, Fault.OUTER, ORDER)
    assert found["depth"].value == pytest.approx(100 * 2 * depth / (1 + depth**2 / 2), rel=0.01)
    assert found["harmonic 2"].value == pytest.approx(20 * math.log10(depth / 4), abs=0.1)
    assert not found["harmonic 5"].present
    assert "sidebands 1" not in found  # an outer-race fault stands still in the load zone


def test_sidebands_of_a_fault_that_passes_the_load_zone():
    line_hz = BEARING.orders.bpfi * SHAFT_HZ
    modulation = (1 + 0.5 * np.cos(2 * math.pi * SHAFT_HZ * TIME_S)) * np.cos(2 * math.pi * line_hz * TIME_S)
    samples = np.sqrt(2 + modulation) * np.sin(2 * math.pi * 2100 * TIME_S)  # its square is the modulation
    noise = 1e-3 * np.random.default_rng(2).standard_normal(TIME_S.size)
    found = pattern(made(samples + noise, Fault.INNER), BEARING, Fault.INNER, BEARING.orders.bpfi)
    assert found["sidebands 1"].value == pytest.approx(20 * math.log10(0.25), abs=0.1)
    assert found["sidebands 2"].value < -30


def test_gaussian_noise_has_a_kurtosis_of_three_and_adds_nothing():
    one, other = (made(np.random.default_rng(seed).standard_normal(TIME_S.size)) for seed in (3, 4))
    value = amplitudes.kurtoses(one)["kurtosis 1400-2800 Hz"]
    assert abs(value.value - 3.0) < 2 * value.ci95
    assert 0 < value.ci95 < 0.4
    assert sum(value.present for value in levels(one, other).values()) <= 1
    louder = replace(one, channels={"a": 1.4 * one.channels["a"]})
    assert sum(value.present for value in levels(louder, other).values()) > 10
    with pytest.raises(ConfigurationError, match="no shaft speed"):
        pattern(replace(one, speed=None), BEARING, Fault.OUTER, ORDER)


def test_the_total_of_two_records_is_the_sum_of_their_powers():
    one = made(np.random.default_rng(3).standard_normal(TIME_S.size))
    alone, twice = amplitudes.totals(one)["total 1000 Hz"], amplitudes.totals(one, one)["total 1000 Hz"]
    assert twice.value - alone.value == pytest.approx(10 * math.log10(2))


def test_a_common_level_and_a_pattern_are_separated():
    level, u, d2 = level_and_pattern(np.full(BANDS, 12.0), COVARIANCE)
    assert level == pytest.approx(12.0)
    assert u == pytest.approx(np.sqrt(COMMON_DB**2 + OWN_DB**2 / BANDS))
    assert d2 == pytest.approx(0.0, abs=1e-9)
    level, _, d2 = level_and_pattern(np.array([3.0, -3.0] * (BANDS // 2)), COVARIANCE)
    assert level == pytest.approx(0.0)
    assert d2 == pytest.approx(BANDS * 9 / OWN_DB**2)
    assert level_and_pattern(np.array([-12.0]), np.array([[36.0]]))[0] == pytest.approx(-12.0)


def test_right_models_are_rejected_as_often_as_they_may_be():
    errors = np.random.default_rng(1).multivariate_normal(np.zeros(BANDS), COVARIANCE, TRIALS)
    level, u, d2 = np.array([level_and_pattern(one, COVARIANCE) for one in errors]).T
    for p in (2 * ndtr(-np.abs(level / u)), chdtrc(BANDS - 1, d2)):
        assert 0.02 < np.mean(p < 0.05) < 0.09  # three deviations of as many trials


@pytest.mark.parametrize("scatter_db", [0.7, 2.0])
def test_the_scatter_of_mountings_is_found_from_bands_to_which_a_fault_adds_nothing(scatter_db, monkeypatch):
    monkeypatch.setattr(amplitudes, "band_powers", lambda planted, _: planted.powers)
    inside, means = [], []
    for seed in range(40):
        random = np.random.default_rng(seed)
        found = mounting_scatter([planted_pair(random, scatter_db) for _ in range(6)], prior_db=2.0)
        inside.append(found["low_db"] <= scatter_db <= found["high_db"])
        means.append(found["scatter_db"])
    assert np.mean(means) == pytest.approx(scatter_db, rel=0.15)
    assert np.mean(inside) > 0.85  # 95 %; three deviations of as many trials


def planted_pair(random: np.random.Generator, scatter_db: float) -> list[SimpleNamespace]:
    """Powers of a faulty and a healthy record, each with levels of its mounting; the fault is in each other band."""
    pair = []
    for fault_db in (30.0, 0.0):
        db = scatter_db * random.standard_normal(len(LEVEL_BANDS)) + fault_db * (np.arange(len(LEVEL_BANDS)) % 2)
        pair.append(SimpleNamespace(powers=dict(zip(LEVEL_BANDS, 10 ** (db / 10), strict=True)), seconds=30.0))
    return pair


def test_without_a_quieter_band_the_prior_remains():
    quiet = made(np.random.default_rng(1).standard_normal(TIME_S.size))
    loud = replace(quiet, channels={"a": 10.0 * quiet.channels["a"]})
    found = mounting_scatter([(loud, quiet)], prior_db=2.0)
    assert (found["quieter"], found["bands"]) == (0, len(LEVEL_BANDS))
    assert found["scatter_db"] == pytest.approx(2.0 * np.sqrt(2 / np.pi), rel=0.01)  # mean of the half-normal prior
