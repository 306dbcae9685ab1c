"""Placebo probabilities of a few combs of every healthy record, and names on records without a fault, in short."""

from pathlib import Path

import numpy as np
import pytest

from srbval.signal.false_alarm import ORDERS
from srbval.studies.false_alarms import study
from srbval.studies.false_alarms.study import (
    alarms,
    distance,
    foreign,
    healthy,
    placebo_lines,
    placebos,
    tried_combs,
    white,
)

# Six combs of each of 90 families, a tenth of them independent of each other: 1.36 / sqrt(200) and what one record's
# combs have in common.
COMBS, HIGHEST_DISTANCE = 6, 0.1
HIGHEST_SHARE = 0.03  # nominal 0.01, twice that in the full study at most


@pytest.mark.slow
@pytest.mark.recordings
def test_placebo_probabilities_are_uniform_on_healthy_records(recordings_dir: Path) -> None:
    read = healthy(recordings_dir)
    tried = [one for _, rig, analysis in read for one in tried_combs(rig, analysis, (ORDERS,), COMBS)]
    assert len(tried) > 400
    placebo, noise = np.array([(t["placebo"][0], t["noise"]) for t in tried]).T
    assert distance(placebo) < HIGHEST_DISTANCE < distance(noise)
    assert np.mean(placebo < 0.01) < HIGHEST_SHARE < np.mean(noise < 0.001)


def test_ranks_are_counted_by_design_and_by_rig() -> None:
    """Of one rig the second design alone keeps its rate, of the other every one: each is scored by the other's."""
    rng = np.random.default_rng(1)
    uniform = rng.random((2, 400, 4))
    uniform[0, :, (0, 2, 3)] /= 10
    tried = [
        {"rig": rig, "placebo": list(row), "noise": 0.5, "before": False, "share": 0.1}
        for rig, rows in zip("ab", uniform, strict=True) for row in rows
    ]  # fmt: skip
    found = placebos(tried)
    assert [row["independent"] for row in found["by_rig"]] == [40, 40]
    assert found["by_rig"][0]["distance"] > 0.8 > 0.1 > found["by_rig"][1]["distance"]
    assert found["design_chosen_on_the_others"][1]["of"] == "b: 1 fundamentals"
    assert found["detected"][0] == dict.fromkeys(found["detected"][0], 0.0)


def test_alarms_on_noise_are_counted() -> None:
    found = alarms(white, 2)
    assert (found["records"], found["chances"], found["fault called"]) == (2, 6, 0)


def test_what_a_line_states_is_rarely_small_where_another_bearing_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where noise alone is below a hundredth in one of ten, and mixed placebos in two of a hundred."""
    monkeypatch.setattr(study, "LENGTHS_S", (2.0,))
    (row,) = placebo_lines(foreign, 30)
    assert row["lines"] > 500
    assert row["noise"] > 0.05
    assert row["stated"] < 0.8 * row["mixed"]
    assert row["stated"] < HIGHEST_SHARE
