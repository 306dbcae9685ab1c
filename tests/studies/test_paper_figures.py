"""The missing harmonic (eq. 20) and the clearness of impulses, on signals whose answer is known."""

from types import SimpleNamespace

import numpy as np
import pytest

from srbval.models.simulate import simulate
from srbval.scene import Scene, paper_scene
from srbval.studies.paper_figures.study import (
    WIDE_BAND_HZ,
    clearness,
    harmonic_heights,
    missing_harmonic,
    missing_of,
    pulse_share,
)

# The pulse is not rectangular: its transform passes zero a little earlier than the sinc of its whole length.
OF_SINC = (0.8, 1.0)
# Clicks have a flat spectrum; the band of 3000 Hz takes less than half off the tenth harmonic.
CLICK_HEIGHT = 0.4
INTERPOLATION = 0.2  # the zero is interpolated linearly between two harmonics of a curved sinc
FS_HZ, LINE_HZ, SECONDS = 20_480.0, 97.03, 1.0


def train(envelope):
    line = SimpleNamespace(found_hz=LINE_HZ, kinematic_hz=96.8)
    processed = SimpleNamespace(envelope=envelope, fs_hz=FS_HZ, filtered=envelope, scale=2.0)
    return clearness(SimpleNamespace(processed=processed, line_of=lambda _: line))


@pytest.mark.parametrize(("jitter", "start"), [(0.0, 0.0), (0.0, 0.49), (0.2, 0.9)])
def test_impulses_of_known_height_and_scatter(jitter, start):
    passage = np.arange(round(FS_HZ * SECONDS)) / FS_HZ * LINE_HZ + start
    heights = 1 + jitter * np.random.default_rng(2).standard_normal(200)
    pulse = np.exp(-0.5 * (((passage + 0.5) % 1 - 0.5) / 0.05) ** 2)
    found = train(0.1 + heights[np.floor(passage + 0.5).astype(int)] * pulse)
    assert found["contrast"] == pytest.approx(11, rel=0.15)
    assert found["scatter_pct"] == pytest.approx(100 * jitter / 1.1, abs=2.5)
    assert found["passages"] == pytest.approx(LINE_HZ * SECONDS - 1.5, abs=1)


def test_noise_has_no_contrast():
    noise = np.abs(np.random.default_rng(1).standard_normal(round(FS_HZ * SECONDS)))
    assert train(noise)["contrast"] < 1.3


def bumpy(model: str, height_mm: float, **changes: object) -> Scene:
    defect = {"kind": "outer", "height_m": height_mm / 1e3}
    return paper_scene(model=model, duration="2 s", defect=defect, **changes)


@pytest.mark.parametrize("model", ["impulse", "planar"])
def test_in_a_wide_band_the_pulse_length_sets_the_missing_harmonic(model: str) -> None:
    """The paper's band of 1000 Hz lengthens pulses of a millisecond: what is missing there says as much of the band."""
    found = [missing_of(simulate(bumpy(model, height))) for height in (0.1, 0.2, 0.3)]
    for one in found:
        assert OF_SINC[0] < one["wide_band"] / one["by_sinc"] < OF_SINC[1]  # type: ignore[operator]
        assert model == "planar" or one["paper_band"] < one["wide_band"]  # type: ignore[operator]
    for name in ("by_sinc", "wide_band"):
        assert found[0][name] > found[1][name] > found[2][name]  # type: ignore[operator]


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
    slow, fast = (pulse_share(bumpy("planar", 0.2, shaft_speed=speed)) for speed in ("353 rpm", "997 rpm"))
    assert slow == fast


@pytest.mark.parametrize("share", [0.13, 0.18, 0.29])
def test_a_sinc_is_read_back(share: float) -> None:
    heights = np.abs(np.sinc(share * np.arange(1, 11)))
    assert missing_harmonic(heights.tolist()) == pytest.approx(1 / share, abs=INTERPOLATION)
