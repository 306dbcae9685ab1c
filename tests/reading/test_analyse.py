"""The analysis of a record, measured or simulated: its lines, the band chosen on it, a speed that is followed."""

import dataclasses

import numpy as np
import pytest

from srbval import Analysis, analyse, load_bearing, recordings, simulate, write_run
from srbval.bearing import DEFECTS, Fault
from srbval.comparison.counterpart import analyse_run, compute_line_order
from srbval.diagnosis.fault_verdict import Finding, fault_verdict
from srbval.reading.analyse import analysis_once
from srbval.reading.pipeline import SIMULATED_BAND_HZ, bands_of_record, declared_band
from srbval.recordings.speed import tachometer_speed
from srbval.scene import SpeedProfile, paper_scene
from srbval.storage.content_store import content_sha256

SIDEBAND_HZ = 0.05  # a fifth of a bin of four seconds: sidebands are read one by one
HARMONIC_RELATIVE = 1e-3  # harmonics are read one by one, by a quarter of a bin at the first
SAME_CHAIN_HZ = 1e-6  # the same samples but for rounding of the two axes
FS_HZ = 20_480.0
SECONDS = 4.0
SHAFT_HZ = 14.3
BEARING = load_bearing("skf-22240")
# Strong impulses without slip: the reading is limited by the sampling of their times only.
READING_PCT = 0.02


def impulses(rate_hz, *, modulation_hz=0.0, depth=0.8, seed=1):
    """Impulses at `rate_hz` ringing at 2 kHz, their size modulated at `modulation_hz`, and noise."""
    times_s = np.arange(0.01, SECONDS - 0.02, 1 / rate_hz)
    sizes = 1 + depth * np.cos(2 * np.pi * modulation_hz * times_s) if modulation_hz else np.ones(times_s.size)
    return rings(times_s, sizes, seed)


def rings(times_s, sizes, seed=1):
    samples = 0.3 * np.random.default_rng(seed).standard_normal(round(SECONDS * FS_HZ))
    ring_s = np.arange(200) / FS_HZ
    ring = np.exp(-ring_s * 1500) * np.sin(2 * np.pi * 2000 * ring_s)
    for at_s, size in zip(times_s, sizes, strict=True):
        first = round(at_s * FS_HZ)
        samples[first : first + ring.size] += 3 * size * ring[: samples.size - first]
    return samples


def recording(samples, **changes):
    speed = recordings.ShaftSpeed(value_hz=SHAFT_HZ, ci95_hz=0.002, source=recordings.SpeedSource.TACHOMETER)
    values = {
        "name": "made up",
        "origin": recordings.Origin.MEASURED,
        "channels": {"vibration": samples},
        "fs_hz": FS_HZ,
    }
    values |= {"channel": "vibration", "unit": "m/s2", "speed": speed, "band_hz": (1400.0, 2800.0)}
    values["file"] = "made_up.mat"
    return recordings.Recording(**(values | changes))


@pytest.fixture(scope="module")
def outer():
    return analyse(recording(impulses(BEARING.orders.bpfo * SHAFT_HZ * 1.002)), bearing=BEARING)


@pytest.fixture(scope="module")
def inner():
    return analyse(recording(impulses(BEARING.orders.bpfi * SHAFT_HZ * 0.999, modulation_hz=SHAFT_HZ)), bearing=BEARING)


def detected(analysis):
    return {line.name for line in analysis.lines if line.detected and line.harmonic == 1}


def test_outer_race_line_and_its_harmonics_are_found_where_they_are(outer):
    first = outer.line("BPFO")
    assert first.detected
    assert first.deviation_pct == pytest.approx(0.2, abs=READING_PCT)
    assert outer.summary.startswith("BPFO (outer race) line detected")
    assert not {"BPFI", "2xBSF"} & detected(outer)
    harmonics = [line for line in outer.lines if line.name == "BPFO"]
    assert [line.harmonic for line in harmonics] == [1, 2, 3, 4, 5]
    for line in harmonics:
        assert line.kinematic_hz == pytest.approx(line.harmonic * BEARING.orders.bpfo * SHAFT_HZ)
        assert line.found_hz == pytest.approx(line.harmonic * first.found_hz, rel=HARMONIC_RELATIVE)


def test_inner_race_line_is_found_with_its_sidebands(inner):
    assert inner.line("BPFI").deviation_pct == pytest.approx(-0.1, abs=READING_PCT)
    assert {"BPFI", "BPFI-fr", "BPFI+fr"} <= detected(inner)
    assert inner.summary.startswith("BPFI (inner race) line detected")
    found = inner.line("BPFI").found_hz
    assert inner.line("BPFI+fr").found_hz == pytest.approx(found + SHAFT_HZ, abs=SIDEBAND_HZ)
    assert inner.line("BPFI-fr").found_hz == pytest.approx(found - SHAFT_HZ, abs=SIDEBAND_HZ)


def test_simulated_axes_go_through_the_same_chain_as_a_sensor_between_them(outer):
    samples = outer.recording.channels["vibration"]
    axes = {"y": samples / np.sqrt(2), "z": samples / np.sqrt(2)}
    run = recording(samples, channels=axes, channel=None, axes=("y", "z"), origin=recordings.Origin.SIMULATED)
    result = analyse(run, bearing=BEARING)
    assert result.line("BPFO").found_hz == pytest.approx(outer.line("BPFO").found_hz, abs=SAME_CHAIN_HZ)
    np.testing.assert_allclose(result.processed.envelope, outer.processed.envelope, rtol=1e-6, atol=1e-9)


def test_harmonic_of_a_slower_comb_and_two_to_three_ratio_of_a_stronger_line_are_no_race_lines():
    line = analyse(recording(impulses(BEARING.orders.bpfo * SHAFT_HZ * 1.002 / 2)), bearing=BEARING).line("BPFO")
    assert not line.detected
    assert "half" in line.explained_by
    bearing = load_bearing("skf-6205")
    shaft_hz = 29.95
    speed = recordings.ShaftSpeed(value_hz=shaft_hz, ci95_hz=0.01, source=recordings.SpeedSource.STATED)
    line_hz = bearing.orders.bpfo * shaft_hz * 1.003
    # Every other impulse weaker: half-order lines, the third of them inside the window of BPFI.
    result = analyse(recording(impulses(line_hz, modulation_hz=line_hz / 2, depth=0.2), speed=speed), bearing=bearing)
    assert result.line("BPFO").detected
    assert result.line("BPFI").explained_by == "3/2 BPFO"
    assert not result.line("BPFI").detected


def test_both_race_lines_close_on_the_number_of_rollers():
    outer_hz = BEARING.orders.bpfo * SHAFT_HZ * 0.998
    samples = impulses(outer_hz) + impulses(19 * SHAFT_HZ - outer_hz, seed=3)
    closure = analyse(recording(samples), bearing=BEARING).closure
    assert closure["expected_hz"] == pytest.approx(19 * SHAFT_HZ)
    assert closure["difference_pct"] == pytest.approx(0.0, abs=2 * READING_PCT)
    assert closure["closed"]


ROUNDING, ROUNDING_PROBABILITY = 1e-6, 1e-12  # of two ways to compute one probability
OUTER = recording(impulses(BEARING.orders.bpfo * SHAFT_HZ))
NOISE = recording(np.random.default_rng(5).standard_normal(OUTER.samples))


def first_harmonics(analysis):
    return [x for x in analysis.lines if x.harmonic == 1 and x.noise_false_alarm is not None]


@pytest.mark.parametrize("record", [OUTER, NOISE], ids=["fault", "noise"])
def test_every_band_tried_on_the_record_counts_as_a_trial(record):
    chosen = analyse(dataclasses.replace(record, band_hz=None), bearing=BEARING)  # nobody states one
    assert chosen.band in bands_of_record(record, BEARING, record.speed)
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
    impulsive = bands_of_record(knocked, BEARING, knocked.speed)[1].band_hz
    assert not analyse(knocked, bearing=BEARING, band_hz=impulsive).line("BPFO").detected
    chosen = analyse(knocked, bearing=BEARING, auto_band=True)
    assert chosen.line("BPFO").detected
    assert chosen.band.why.startswith("the whole band, ")


def test_a_simulated_record_of_a_larger_bearing_is_read_as_much_lower():
    run = dataclasses.replace(OUTER, origin=recordings.Origin.SIMULATED, band_hz=None)

    def band_of_size(size, stated=None):
        sizes = {key: size * value for key, value in vars(BEARING.geometry).items() if key.endswith("_m")}
        scaled = dataclasses.replace(BEARING, geometry=dataclasses.replace(BEARING.geometry, **sizes))
        return declared_band(run, stated, scaled)

    assert [band_of_size(size).band_hz for size in (1, 2, 0.5)] == [(500, 1500), (250, 750), (500, 1500)]
    assert "2 times as large" in band_of_size(2).why
    assert band_of_size(2, (600, 900)).band_hz == (600, 900)
    ball_bearing = load_bearing("skf-6205")  # not similar to the paper's
    assert declared_band(run, None, ball_bearing).band_hz == declared_band(run, None).band_hz == (500, 1500)


RAMP = 0.05  # of the mean speed, from the first sample to the last
SLIP = 1.002
RAMP_PCT = 0.03


def test_a_fault_on_a_speed_ramp_is_read_only_because_the_speed_signal_is_followed():
    """Impulses of a fault at even shaft angles while the shaft speeds up by 5 %."""
    time_s = np.arange(round(SECONDS * FS_HZ)) / FS_HZ
    turns = SHAFT_HZ * ((1 - RAMP / 2) * time_s + RAMP * time_s**2 / (2 * SECONDS))
    strikes = np.arange(1, turns[-1] * BEARING.orders.bpfo * SLIP - 2) / (BEARING.orders.bpfo * SLIP)
    samples = rings(np.interp(strikes, turns, time_s), np.ones(strikes.size))
    speed = SHAFT_HZ * np.linspace(1 - RAMP / 2, 1 + RAMP / 2, 2560)
    course = recordings.SpeedSignal(values_hz=speed, rate_hz=speed.size / SECONDS)
    record = recording(samples, speed=tachometer_speed(speed), speed_signal=course)
    with_course = analyse(record, bearing=BEARING)
    assert with_course.processed.tracking.used
    assert with_course.to_dict()["order_tracking"]["drift_bins"] > 20
    line = with_course.line("BPFO")
    assert line.detected
    assert line.deviation_pct == pytest.approx(100 * (SLIP - 1), abs=RAMP_PCT)
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
    for record in (recordings.recording_from_run(run), recordings.load_recording(tmp_path / "ramp.h5")):
        analysis = analyse(record, bearing=BEARING)
        line = analysis.line("BPFO")
        assert analysis.processed.tracking.used
        assert line.detected
        assert line.found_hz == pytest.approx(run.bpfo_hz, rel=RAMP_PCT / 100)


@pytest.mark.parametrize("rpm_is_nominal", [False, True])
def test_a_stored_analysis_is_the_analysis(rpm_is_nominal, monkeypatch):
    stated = recordings.ShaftSpeed(value_hz=SHAFT_HZ, ci95_hz=0.1, source=recordings.SpeedSource.NOMINAL)
    record = recording(impulses(BEARING.orders.bpfo * SHAFT_HZ), **({"speed": stated} if rpm_is_nominal else {}))
    first, direct = analysis_once(record, BEARING, auto_band=True), analyse(record, bearing=BEARING, auto_band=True)
    monkeypatch.setattr("srbval.reading.analyse.search", None)  # a second search would fail
    again = analysis_once(record, BEARING, auto_band=True)
    for one in (first, again):
        assert one.to_dict() == direct.to_dict()
        assert one.lines == direct.lines
        assert np.array_equal(one.processed.squared, direct.processed.squared)
    assert content_sha256(again) == content_sha256(first)  # a figure of it is not drawn again


TURNS = 30.0


LONG = [pytest.param(*one, marks=pytest.mark.long_form) for one in ((997.0, "play"), (858.0, "printed"))]


@pytest.mark.parametrize(("rpm", "fit"), [(710.0, "play"), *LONG])
def test_healthy_model_shows_no_fault(rpm, fit):
    """Judged as if it had been measured and not labelled, alone and against another run of the same bearing."""
    judged, before = (model(rpm, fit, settle) for settle in ("0.05 s", "0.17 s"))
    assert all(judged.line_of(fault).found_hz is not None for fault in DEFECTS)
    for baseline in (None, before):
        verdict = fault_verdict(judged, baseline)
        assert verdict.finding in (Finding.UNDECIDED, Finding.NOTHING_FOUND)
        assert verdict.part is None


def model(rpm: float, fit: str, settle: str) -> Analysis:
    sound = {"defect": {"kind": "none"}, "contact": {"roller_fit": fit}, "settle": settle}
    scene = paper_scene(duration_s=TURNS * 60 / rpm, shaft_speed_rad_s=rpm * np.pi / 30, **sound)
    recording = recordings.recording_from_run(simulate(scene))
    own = {"origin": recordings.Origin.MEASURED, "state": None, "band_hz": SIMULATED_BAND_HZ}
    return analyse(dataclasses.replace(recording, **own), bearing=BEARING)


def test_the_model_s_roller_and_cage_are_read_from_its_vibration():
    """Both are known from the run: the damaged roller's own turning, seen from its slot, and the cage's speed."""
    damaged = {"contact": {"roller_fit": "printed"}, "defect": {"kind": "roller", "height": "-0.1 mm"}}
    scene = paper_scene(duration_s=3.0, detail_rate_hz=1024.0, **damaged)
    run = simulate(scene)
    side = analyse_run(run, BEARING)
    line, shaft_hz = side.analysis.line("2xBSF"), scene.shaft_hz
    order = compute_line_order(run, Fault.ROLLER, BEARING)
    assert line.detected
    assert abs(line.found_hz - order * shaft_hz) <= line.ci95_hz
    assert line.ci95_hz < 1e-3 * line.found_hz
    assert abs(line.sideband_hz - run.cage_ratio * shaft_hz) <= line.sideband_ci95_hz
    assert line.sideband_ci95_hz < 0.01 * line.sideband_hz
    assert all(side.analysis.line(name).detected for name in ("2xBSF-FTF", "2xBSF+FTF"))
    # Three contact circles of different radii: the roller turns faster than its middle circle alone would have it.
    assert 1.01 < order / (2 * BEARING.orders.bsf) < 1.03
    assert run.cage_ratio == pytest.approx(BEARING.orders.ftf, rel=0.005)
