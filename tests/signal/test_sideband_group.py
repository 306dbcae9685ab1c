"""Groups of a rolling element's lines: found where its strikes recur with the cage, wherever their phase has gone."""

from __future__ import annotations

import math

import numpy as np
import pytest

from srbval.signal import Periodogram
from srbval.signal.comb_spectrum import strongest_group
from srbval.signal.false_alarm import neg_log_rank

FS_HZ, SECONDS, SHAFT_HZ, CAGE_HZ, STRIKES_HZ = 2000.0, 8.0, 14.3, 6.15, 99.6
RELATIVE = 0.01


def record(turns_lost: float, *, strength: float = 1.0, seed: int = 0) -> Periodogram:
    """The squared envelope of strikes at `STRIKES_HZ` in the load zone, a third of the cage's revolution, in noise.

    From one passage to the next the element turns so many strikes less than at that rate.
    """
    rng = np.random.default_rng(seed)
    envelope = 1 + 0.5 * rng.standard_normal(round(FS_HZ * SECONDS))
    for passage in range(math.ceil(SECONDS * CAGE_HZ)):
        start = passage / CAGE_HZ
        first = start * STRIKES_HZ - turns_lost * passage
        for strike in range(math.ceil(first), math.floor(first + STRIKES_HZ / 3 / CAGE_HZ) + 1):
            at = round((start + (strike - first) / STRIKES_HZ) * FS_HZ)
            envelope[at : at + 6] += strength
    return Periodogram.of(envelope, FS_HZ, limit_hz=400.0, shaft_hz=SHAFT_HZ)


@pytest.mark.parametrize("turns_lost", [0.0, 0.3, 0.5, 1.8])
def test_a_group_is_found_wherever_its_lines_stand(turns_lost: float) -> None:
    group, others = strongest_group(record(turns_lost), STRIKES_HZ, CAGE_HZ, RELATIVE)
    assert group is not None
    assert group.score > others.max() + 2
    assert neg_log_rank(group.score, others) > -math.log(0.01)
    assert group.spacing_hz == pytest.approx(CAGE_HZ, rel=RELATIVE)
    # One line is where the phase recurs with the cage: (whole number + strikes per passage) times the cage frequency.
    places = (group.found_hz - STRIKES_HZ) / CAGE_HZ + turns_lost
    assert abs(places - round(places)) < 0.15


def test_noise_has_no_group_that_stands_out() -> None:
    ranks = []
    for seed in range(40):
        group, others = strongest_group(record(0.0, strength=0.0, seed=seed), STRIKES_HZ, CAGE_HZ, RELATIVE)
        assert group is not None
        ranks.append(math.exp(-neg_log_rank(group.score, others)))
    assert np.mean(np.array(ranks) < 0.1) < 0.3
    assert min(ranks) > 1e-3


def test_a_group_beyond_the_record_s_reach_is_none() -> None:
    for centre_hz in (199.0, 2.9 * CAGE_HZ):
        group, others = strongest_group(record(0.0), centre_hz, CAGE_HZ, RELATIVE)
        assert group is None
        assert others.size == 0
