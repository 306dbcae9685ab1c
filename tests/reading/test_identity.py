"""The probability that a found peak is the line: from the slip prior and how strong it is, not from the window."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import scipy.integrate
import scipy.stats

from srbval.bearing import LARGEST_SLIP, load_bearing
from srbval.diagnosis.baseline_comparison import _ratio, compare_with_baseline
from srbval.reading.analyse import analyse
from srbval.reading.families import LEAST_IDENTITY, OTHER_LINE
from srbval.reading.identity import SLIP_FREEDOM, SLIP_SPREAD, identity_probability
from srbval.recordings import load_recording
from srbval.signal import LEAST_SNR, LineReading
from tests.diagnosis.test_fault_call import faulted_analysis, healthy_analysis

HALF, LINE_HZ = 0.01, 100.0


def probability(
    deviation: float, speed_ci95: float, chance: float, *, half: float = HALF, largest_slip: float = LARGEST_SLIP
) -> float:
    reading = LineReading(
        found_hz=LINE_HZ * (1 + deviation), ci95_hz=0.0, snr=(20.0,), noise_false_alarm=chance,
        half_window_hz=half * LINE_HZ, isolated=True, depth=0.1, noise_ci95_hz=0.0, resolution_hz=0.1,
    )  # fmt: skip
    return identity_probability(reading, LINE_HZ, speed_ci95, chance, largest_slip)


def odds(probability: float) -> float:
    return probability / (1 - probability)


def test_position_alone_is_a_ratio_of_densities() -> None:
    """No strength (p = 1): odds are the prior's density over the uniform one, whose mean over the window is one."""
    at = np.linspace(-HALF, HALF, 4001)
    ratio = [odds(probability(float(d), 0.0, 1.0)) for d in at]
    assert scipy.integrate.trapezoid(ratio, at) / (2 * HALF) == pytest.approx(1, rel=1e-3)
    slip = scipy.stats.t(SLIP_FREEDOM, scale=SLIP_SPREAD)
    assert ratio[2000] == pytest.approx(2 * HALF * slip.pdf(0) / (1 - 2 * slip.sf(HALF)), rel=1e-3)


def test_probability_is_the_share_of_lines_whatever_they_slip() -> None:
    """Lines by the prior, others anywhere, equally strong: of those called p a share p are lines, far off too."""
    rng, count = np.random.default_rng(3), 20_000
    slips = SLIP_SPREAD * rng.standard_t(SLIP_FREEDOM, 2 * count)
    slips = slips[np.abs(slips) < HALF][:count]
    places = np.concatenate((slips, rng.uniform(-HALF, HALF, count)))
    is_line = np.arange(2 * count) < count
    called = np.array([probability(float(d), 0.0, 1.0) for d in places])
    for low, high in ((0.0, 0.05), (0.05, 0.1), (0.1, 0.3), (0.3, 0.6), (0.6, 0.8), (0.8, 1.0)):
        group = (called >= low) & (called < high)
        scatter = 0.5 / np.sqrt(group.sum())
        assert np.mean(is_line[group]) == pytest.approx(np.mean(called[group]), abs=4 * scatter)


def test_further_off_or_weaker_is_less_probable_and_an_unsure_speed_says_less() -> None:
    near, far = (probability(d, 1e-4, 1e-4) for d in (0.001, 0.006))
    assert near > 0.99 > LEAST_IDENTITY > probability(0.0095, 1e-4, 1e-4)
    assert near > far > probability(0.006, 1e-4, 1e-2)
    assert probability(0.0095, 2e-2, 1e-4) > 0.99
    assert probability(-0.006, 1e-4, 1e-4) == pytest.approx(far)


def test_a_chance_of_one_in_a_hundred_weighs_no_more_than_eight_to_one() -> None:
    """The bound -e p ln p: 0.125 at p = 0.01."""
    flat = probability(0.0, 2.0, 0.01)
    assert odds(flat) == pytest.approx(1 / (np.e * 0.01 * np.log(100)), rel=1e-3)


def test_another_line_in_the_baseline_counts_as_one_that_hides_ours() -> None:
    """Judged against the other's depth the ratio would be smaller; the unseen line is at most ten times the noise."""
    analysis, baseline = faulted_analysis(), healthy_analysis()
    strong = dataclasses.replace(baseline.line("BPFI"), depth=0.4, snr=16 * LEAST_SNR)

    def ratio(explained: str | None) -> float:
        line = dataclasses.replace(strong, explained_by=explained)
        lines = tuple(line if (x.name, x.harmonic) == ("BPFI", 1) else x for x in baseline.lines)
        found = _ratio(analysis, analysis.line("BPFI"), dataclasses.replace(baseline, lines=lines), False)
        assert found is not None
        return found[0]

    assert ratio(OTHER_LINE) == pytest.approx(4 * ratio(None))


@pytest.mark.recordings
def test_the_rig_s_healthy_record_has_another_line_at_the_edge_of_the_window(recordings_dir: Path) -> None:
    bearing = load_bearing("skf-22240")
    healthy, outer, inner = (
        analyse(load_recording(recordings_dir / "torino" / f"{name}_877rpm_sample.mat"), bearing=bearing)
        for name in ("H", "OR", "IR")
    )
    line = healthy.line("BPFO")
    assert line.deviation_pct == pytest.approx(-0.945, abs=0.02)
    assert line.noise_false_alarm is not None
    assert line.noise_false_alarm < 1e-4
    assert line.identity_probability is not None
    assert line.identity_probability < LEAST_IDENTITY
    assert (line.detected, line.explained_by) == (False, OTHER_LINE)
    assert "no race or roller line shows" in compare_with_baseline(healthy).sentence
    for analysis, name in ((outer, "BPFO"), (inner, "BPFI")):
        assert (analysis.line(name).identity_probability or 0) > 0.99
        assert compare_with_baseline(analysis, healthy).line == name


@pytest.mark.recordings
def test_a_cage_that_slips_by_half_a_per_cent_keeps_its_line(recordings_dir: Path) -> None:
    """A normal prior passed it by strength alone, at 0.62; a line a hundred times weaker would have been cut off."""
    path = recordings_dir / "mfpt" / "OuterRaceFault_vload_1.mat"
    line = analyse(load_recording(path), bearing=load_bearing("mfpt-nice")).line("BPFO")
    assert line.deviation_pct == pytest.approx(-0.587, abs=0.02)
    assert line.detected
    assert (line.identity_probability or 0) > 0.9
    assert probability(-0.00587, 0.001, 1e-3) > LEAST_IDENTITY
