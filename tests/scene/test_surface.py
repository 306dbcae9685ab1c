"""Surfaces of races and rollers: the Ra of their class, the height that was given, and what is refused."""

import math

import numpy as np
import pytest

from srbval.arrays import FloatArray
from srbval.cli.arguments import parser
from srbval.cli.scene_commands import scene_of
from srbval.errors import ConfigurationError
from srbval.models.run import not_validated
from srbval.models.run_file import scene_dict
from srbval.scene import Surface, paper_scene
from srbval.scene.surface import RoughnessClass

ROUND_M = 0.1  # of a body whose whole roughness is generated
RA_TOLERANCE = 0.03  # classes are a factor of two apart
HALF = 0.4697  # ISO 16610-21
OPTIONS = ("", "--roughness N2", "--waviness-nm 28")


def profile(surface: Surface, shortest_m: float, seed: int) -> FloatArray:
    """The power law continued down to `shortest_m`, random phases, 8 points to the shortest wave."""
    orders = np.arange(1, math.floor(ROUND_M / shortest_m) + 1)
    size = 8 * int(orders[-1])
    lines = np.zeros(size // 2 + 1, dtype=np.complex128)
    phase = np.random.default_rng(seed).uniform(0, 2 * math.pi, orders.size)
    amplitude = np.sqrt(2 * surface.density_m() * (ROUND_M / orders) ** (2 * surface.exponent) / ROUND_M)
    lines[orders] = size / 2 * amplitude * np.exp(1j * phase)
    return np.fft.irfft(lines, n=size)


def weighted_mean(samples: FloatArray, cutoff_m: float) -> FloatArray:
    """Gaussian profile filter of ISO 16610-21 in its own words: a weighing function along a closed profile."""
    step = ROUND_M / samples.size
    place = (np.arange(samples.size) * step + ROUND_M / 2) % ROUND_M - ROUND_M / 2
    weight = np.exp(-math.pi * (place / (HALF * cutoff_m)) ** 2) / (HALF * cutoff_m) * step
    return np.fft.irfft(np.fft.rfft(samples) * np.fft.rfft(weight), n=samples.size)


@pytest.mark.parametrize(
    ("name", "exponent", "ra_m", "cutoff_m", "finest_m"),
    [  # ISO 1302 and ISO 4288
        ("N2", 1.0, 0.05e-6, 0.25e-3, 2.5e-6),
        ("N4", 1.5, 0.2e-6, 0.8e-3, 2.5e-6),
        ("N7", 0.5, 1.6e-6, 0.8e-3, 2.5e-6),
    ],
)
def test_the_profile_has_the_ra_of_its_class(name, exponent, ra_m, cutoff_m, finest_m):
    surface = Surface(roughness_class=RoughnessClass(name), exponent=exponent)
    whole = profile(surface, finest_m / 2, seed=1)
    without_noise = weighted_mean(whole, finest_m)
    found = without_noise - weighted_mean(without_noise, cutoff_m)
    assert np.abs(found).mean() == pytest.approx(ra_m, rel=RA_TOLERANCE)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 2.0])
def test_a_given_height_is_the_rms_of_the_waves(exponent):
    surface = Surface(outer_waviness_m=5e-8, exponent=exponent)
    amplitudes, orders = surface.amplitudes(1.0, 5e-8), surface.orders(1.0)
    assert np.sqrt(np.sum(amplitudes**2) / 2) == pytest.approx(5e-8)
    assert (orders[0], orders[-1]) == (20, 1000)
    assert amplitudes[-1] / amplitudes[0] == pytest.approx((1000 / 20) ** -exponent)


def test_heights_of_a_class_do_not_hang_on_the_size_of_the_body():
    """Waves of 1 to 10 mm are as high on a body three times as large: it has three times as many orders there."""
    surface = Surface(roughness_class=RoughnessClass("N3"), shortest_m=1e-3, longest_m=10e-3)
    small, large = (np.sqrt(np.sum(surface.amplitudes(r, None) ** 2) / 2) for r in (0.3, 0.9))
    assert large == pytest.approx(small, rel=0.02)


def test_a_wave_that_fits_no_body_is_refused():
    surface = Surface(roller_waviness_m=1e-7, shortest_m=0.3, longest_m=0.4)
    with pytest.raises(ConfigurationError, match=r"no whole number of waves of 0\.3 to 0\.4 m fits around 0\.126 m"):
        surface.amplitudes(0.126, 1e-7)
    assert not surface.amplitudes(0.126, 0.0).size


def test_a_surface_is_stored_and_named_as_not_validated():
    waves, scene = "waves of races and rollers", paper_scene(surface={"roughness_class": "N3"})
    assert scene_dict(scene)["surface"]["roughness_class"] == "N3"
    assert waves in not_validated(scene)
    assert waves not in not_validated(paper_scene())
    assert "surface" not in scene_dict(paper_scene())


def test_options_give_a_class_or_one_height_to_all():
    made = [scene_of(parser().parse_args(["simulate", "rig", *more.split()])).surface for more in OPTIONS]
    assert (made[0], made[1]) == (None, Surface(roughness_class=RoughnessClass("N2")))
    assert made[2].given_m == pytest.approx((28e-9,) * 3)
