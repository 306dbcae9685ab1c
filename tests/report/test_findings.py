"""What figures and tables are given: clearness of impulses, names of lines and of tall peaks."""

from types import SimpleNamespace

import numpy as np
import pytest

from srbval.report.findings.patterns import clearness
from srbval.report.findings.records import fault_cursors, tall_peaks
from srbval.scene import LoadPath, RollerFit

FS_HZ, LINE_HZ, SECONDS = 20_480.0, 97.03, 1.0


def train(envelope):
    line = SimpleNamespace(found_hz=LINE_HZ, kinematic_hz=96.8)
    processed = SimpleNamespace(envelope=envelope, fs_hz=FS_HZ, filtered=envelope, scale=2.0)
    return clearness(RollerFit.PLAY, LoadPath.HOUSING, SimpleNamespace(processed=processed, line_of=lambda _: line))


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


def test_cursors_are_named_as_the_field_does():
    names = [c.name for c in fault_cursors("BPFI", 128.0, 270, sideband_hz=12.0, sidebands=1)]
    assert names == ["BPFI-fr", "BPFI", "BPFI+fr", "2xBPFI-fr", "2xBPFI", "2xBPFI+fr"]


def test_tall_peaks_are_named_by_what_they_are():
    frequency = np.arange(0, 6000) * 0.1
    height = np.full(frequency.size, 0.01)
    peaks = {11.83: "fr", 96.79: "BPFO", 193.58: "2xBPFO", 102.7: "BPFO+0.50fr", 340.0: "28.73fr", 256.08: None}
    for hz, tall in zip(peaks, (1.0, 0.9, 0.5, 0.6, 0.7, 1.0), strict=True):
        height[round(10 * hz)] = tall
    height[round(10 * 500.0)] = 0.3  # below a third of the tallest
    found = tall_peaks(
        frequency, height, 600.0, shaft_hz=11.833, marked_hz=[128.04, 256.08],
        orders={"fr": 1.0, "BPFO": 8.1794, "BPFI": 10.8206, "FTF": 0.4305},
    )  # fmt: skip
    assert {round(hz, 1): name for name, hz, _ in found} == {round(hz, 1): n for hz, n in peaks.items() if n}
    assert [tall for _, _, tall in found] == sorted((tall for _, _, tall in found), reverse=True)
