"""Placebo probabilities of a few combs of every healthy record: the study's own claim, in short."""

from pathlib import Path

import numpy as np
import pytest

from srbval.reading.analyse import analyse
from srbval.signal.false_alarm import ORDERS
from srbval.studies.placebo.study import distance, healthy, tried_combs

# Six combs of each of 90 families, a tenth of them independent of each other: 1.36 / sqrt(200) and what one record's
# combs have in common.
COMBS, HIGHEST_DISTANCE = 6, 0.1
HIGHEST_SHARE = 0.03  # nominal 0.01, twice that in the full study at most


@pytest.mark.slow
@pytest.mark.recordings
def test_placebo_probabilities_are_uniform_on_healthy_records(recordings_dir: Path) -> None:
    tried = [
        one
        for rig, recording, bearing in healthy(recordings_dir)
        for one in tried_combs(rig, analyse(recording, bearing=bearing), (ORDERS,), COMBS)
    ]
    assert len(tried) > 400
    placebo, noise = np.array([(t.placebo[0], t.noise) for t in tried]).T
    assert distance(placebo) < HIGHEST_DISTANCE < distance(noise)
    assert np.mean(placebo < 0.01) < HIGHEST_SHARE < np.mean(noise < 0.001)


def test_distance_of_a_known_sample() -> None:
    assert distance([0.5]) == pytest.approx(0.5)
    assert distance([0.1, 0.2, 0.3]) == pytest.approx(0.7)
