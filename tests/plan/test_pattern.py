"""The paper's remark on Figure 12 (a missing harmonic, eq. 20), tested on every model."""

from __future__ import annotations

import numpy as np
import pytest

from srbval.models.simulate import simulate
from srbval.plan.measures import WIDE_BAND_HZ, harmonic_heights, missing_harmonic, missing_of, pulse_of
from srbval.scene import Scene, paper_scene

# The pulse is not rectangular: its transform passes zero a little earlier than the sinc of its whole length.
OF_SINC = (0.8, 1.0)
# Clicks have a flat spectrum; the band of 3000 Hz takes less than half off the tenth harmonic.
CLICK_HEIGHT = 0.4
INTERPOLATION = 0.2  # the zero is interpolated linearly between two harmonics of a curved sinc


def bumpy(model: str, height_mm: float, **changes: object) -> Scene:
    defect = {"kind": "outer", "height_m": height_mm / 1e3}
    return paper_scene(model=model, duration="2 s", defect=defect, **changes)


@pytest.mark.parametrize("model", ["impulse", "planar"])
def test_in_a_wide_band_the_pulse_length_sets_the_missing_harmonic(model: str) -> None:
    found = [missing_of(simulate(bumpy(model, height))) for height in (0.1, 0.2, 0.3)]
    for one in found:
        assert one.wide_band is not None
        assert OF_SINC[0] < one.wide_band / one.by_sinc < OF_SINC[1]
    assert found[0].by_sinc > found[1].by_sinc > found[2].by_sinc
    assert found[0].wide_band > found[1].wide_band > found[2].wide_band  # type: ignore[operator]


def test_in_the_papers_band_it_stands_lower() -> None:
    """The band of 1000 Hz lengthens pulses of a millisecond: what is missing says as much of it as of the bump."""
    for height in (0.1, 0.2, 0.3):
        found = missing_of(simulate(bumpy("impulse", height)))
        assert found.paper_band < found.wide_band  # type: ignore[operator]


def test_clicks_without_length_miss_none() -> None:
    heights = harmonic_heights(simulate(bumpy("kinematic", 0.2)), WIDE_BAND_HZ)
    assert missing_harmonic(heights) is None
    assert min(heights) > CLICK_HEIGHT


def test_the_full_model_misses_one_and_a_higher_bump_an_earlier_one() -> None:
    low, high = (
        missing_harmonic(
            harmonic_heights(simulate(bumpy("full", height, contact={"roller_fit": "printed"})), (500, 1500))
        )
        for height in (0.05, 0.3)
    )
    assert low is not None
    assert high is not None
    assert high < low


def test_pulse_length_does_not_depend_on_speed() -> None:
    slow, fast = (pulse_of(bumpy("planar", 0.2, shaft_speed=speed)) for speed in ("353 rpm", "997 rpm"))
    assert slow == fast


@pytest.mark.parametrize("share", [0.13, 0.18, 0.29])
def test_a_sinc_is_read_back(share: float) -> None:
    heights = np.abs(np.sinc(share * np.arange(1, 11)))
    assert missing_harmonic(heights.tolist()) == pytest.approx(1 / share, abs=INTERPOLATION)
