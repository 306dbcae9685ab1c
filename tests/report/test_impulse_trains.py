"""Clear impulses have much contrast and little scatter; noise has neither."""

from types import SimpleNamespace

import numpy as np
import pytest

from srbval.report.findings.impulse_trains import _train
from srbval.scene import LoadPath, RollerFit

FS_HZ, LINE_HZ, SECONDS = 20_480.0, 97.03, 1.0


def train(envelope):
    line = SimpleNamespace(found_hz=LINE_HZ, kinematic_hz=96.8)
    processed = SimpleNamespace(envelope=envelope, fs_hz=FS_HZ, filtered=envelope, scale=2.0)
    return _train(RollerFit.PLAY, LoadPath.HOUSING, SimpleNamespace(processed=processed, line_of=lambda _: line))


@pytest.mark.parametrize(("jitter", "start"), [(0.0, 0.0), (0.0, 0.49), (0.2, 0.9)])
def test_impulses_of_known_height_and_scatter(jitter, start):
    passage = np.arange(round(FS_HZ * SECONDS)) / FS_HZ * LINE_HZ + start
    heights = 1 + jitter * np.random.default_rng(2).standard_normal(200)
    pulse = np.exp(-0.5 * (((passage + 0.5) % 1 - 0.5) / 0.05) ** 2)
    found = train(0.1 + heights[np.floor(passage + 0.5).astype(int)] * pulse)
    assert found.contrast == pytest.approx(11, rel=0.15)
    assert found.scatter_pct == pytest.approx(100 * jitter / 1.1, abs=2.5)
    assert found.passages == pytest.approx(LINE_HZ * SECONDS - 1.5, abs=1)


def test_noise_has_no_contrast():
    noise = np.abs(np.random.default_rng(1).standard_normal(round(FS_HZ * SECONDS)))
    assert train(noise).contrast < 1.3
