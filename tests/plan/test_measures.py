"""The measures that runs are compared by, on signals whose answer is known."""

import math

import numpy as np
import pytest

from srbval.bearing import load_bearing
from srbval.models.simulate import simulate
from srbval.path.amplitudes import HARMONICS, KURTOSIS_BANDS, RMS_BANDS, SIDEBANDS, THIRD_OCTAVES
from srbval.plan.measures import line_heights, noise_floor, smooth_mean
from srbval.plan.questions import MEANING, Question, answers, error_pct
from srbval.recordings import recording_from_run
from srbval.scene import paper_scene

FS = 20480.0
MEDIAN_SCATTER = 0.1  # standard error of the median of 600 Rayleigh-distributed lines is 4 %
LINE_SKIRTS = 0.05  # of two lines in the range of 120 lines whose median is taken
OFF_BIN = 1e-3  # the lines are looked up 1e-5 beside their frequency
RIPPLE = 1e-6  # a ripple of 0.3 % over 38 periods: 1/n^3 of it remains under the window, 1/n in a plain mean
EQUAL_SAMPLES = 1e-9  # the mean of many equal samples


def test_noise_floor_is_that_of_white_noise_and_does_not_see_single_lines() -> None:
    """Spectral lines of white noise are Rayleigh-distributed: median 2 sigma sqrt(ln 2 / n)."""
    t, sigma, mean = np.arange(20 * 20480) / FS, 1e-3, 1.7
    noise = np.random.default_rng(4).normal(mean, sigma, t.size)
    quiet = noise_floor(noise, FS)
    assert quiet == pytest.approx(2 * sigma * math.sqrt(math.log(2) / t.size) / mean, rel=MEDIAN_SCATTER)
    lines = noise + 0.2 * np.sin(2 * np.pi * 71.0 * t) + 0.9 * np.sin(2 * np.pi * 97.1 * t)
    assert noise_floor(lines, FS) == pytest.approx(quiet, rel=LINE_SKIRTS)


def test_line_heights() -> None:
    t, hz, heights = np.arange(2 * 20480) / FS, 97.0, (2.0, 1.0, 0.5, 0.25, 0.125)
    signal = sum(a * np.sin(2 * np.pi * k * hz * t) for k, a in enumerate(heights, start=1))
    found = line_heights(np.asarray(signal), FS, [k * hz * (1 + 1e-5) for k in range(1, 6)])
    assert found == pytest.approx(heights, rel=OFF_BIN)


def test_ripple_hardly_moves_the_smooth_mean() -> None:
    t = np.arange(8193) / FS
    ripple = 32.0 + 0.1 * np.sin(2 * np.pi * 96.3 * t + 0.4)
    assert smooth_mean(ripple) == pytest.approx(32.0, rel=RIPPLE)
    assert abs(ripple.mean() / 32.0 - 1) > RIPPLE, "the plain mean is what this is better than"


@pytest.mark.parametrize("kind", ["none", "outer", "inner"])
def test_lines_stand_where_the_cage_puts_them(kind: str) -> None:
    run = simulate(paper_scene(model="kinematic", duration="1 s", defect={"kind": kind}))
    found = answers(run, load_bearing("skf-22240"))[Question.LINES]
    assert found == pytest.approx((run.bpfi_hz if kind == "inner" else run.bpfo_hz,), rel=EQUAL_SAMPLES)


def test_amplitudes_are_those_that_are_compared_with_the_rig() -> None:
    known = {*RMS_BANDS, *THIRD_OCTAVES, *KURTOSIS_BANDS, "depth"}
    known |= {f"harmonic {n}" for n in HARMONICS} | {f"sidebands {n}" for n in SIDEBANDS}
    assert {name for meaning in MEANING.values() for name in meaning.read} == known
    run, healthy = (
        simulate(paper_scene(model="impulse", duration="1 s", defect={"kind": kind})) for kind in ("inner", "none")
    )
    bare = answers(run, load_bearing("skf-22240"))
    assert bare[Question.THIRD_OCTAVES] is None, "an increment is over something"
    found = answers(run, load_bearing("skf-22240"), recording_from_run(healthy))
    assert all(found[question] for question, meaning in MEANING.items() if meaning.read)


def test_three_decibels_are_41_per_cent_and_what_the_reference_does_not_show_is_not_asked() -> None:
    three = error_pct(Question.HARMONIC_LEVELS, (1.0, 9.0, -3.0), (1.0, None, 0.0))
    assert three == pytest.approx(41.25, abs=0.01)
    assert MEANING[Question.HARMONIC_LEVELS].text(three) == "3 dB"
    assert error_pct(Question.HARMONIC_LEVELS, (1.0, None), (1.0, 2.0)) is None, "what a model does not show it lacks"
