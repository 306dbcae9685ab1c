"""Placebo probabilities of a few combs of every healthy record: the calibrator's own claim, in short."""

from pathlib import Path

import numpy as np
import pytest
from srbval.signal.false_alarm import ORDERS

from srbval.reading.analyse import analyse
from srbval.studies.placebo.study import cost_s, distance, healthy, tried_combs

# Six combs of each of 90 families, a tenth of them independent of each other: 1.36 / sqrt(200) and what one record's
# combs have in common.
COMBS, HIGHEST_DISTANCE = 6, 0.1
MOST_S = 0.1  # of records of 2 to 13 s
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


@pytest.mark.recordings
def test_placebos_take_no_more_than_a_tenth_of_a_second_of_a_record(recordings_dir: Path) -> None:
    for rig, recording, bearing in healthy(recordings_dir):
        if rig != "ims":
            assert cost_s(recording, bearing)[1] < MOST_S, recording.name


def test_distance_of_a_known_sample() -> None:
    assert distance([0.5]) == pytest.approx(0.5)
    assert distance([0.1, 0.2, 0.3]) == pytest.approx(0.7)
