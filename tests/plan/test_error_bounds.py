from __future__ import annotations

import numpy as np
import pytest

from srbval.plan import calibrated
from srbval.plan.calibrated import LEAST_SCENES, Margin, margins, shipped_calibration


def test_the_chance_it_states_is_that_of_the_largest_of_so_many() -> None:
    """Whatever the errors' distribution: of 4,000 draws of 24 ratios and a new one, 24 in 25 are within."""
    random = np.random.default_rng(3)
    ratios = np.exp(random.standard_cauchy((4000, 25)).clip(-20, 20))
    held = np.mean(ratios[:, -1] <= ratios[:, :-1].max(axis=1))
    stated = Margin(factor=1.0, scenes=24).coverage
    assert stated == pytest.approx(24 / 25)
    assert held == pytest.approx(stated, abs=3 * np.sqrt(stated * (1 - stated) / 4000))


def test_margins_of_the_shipped_table_are_per_fit_rung_and_question() -> None:
    table = shipped_calibration()
    found = margins(table)
    assert {key[0] for key in found} == {"play", "printed"}
    assert all(one.factor >= 1.0 and one.scenes >= LEAST_SCENES for one in found.values())
    assert margins(table) is found, "read once"
    assert len(table.between) >= LEAST_SCENES


def test_a_margin_covers_what_was_seen_and_too_few_scenes_give_none(monkeypatch: pytest.MonkeyPatch) -> None:
    table = shipped_calibration()
    key = next(key for key, one in margins(table).items() if one.factor > 1)
    ratios = [
        calibrated._measured_over_predicted(entry, calibrated.corners(table.entries, entry.case), key[1], key[2])
        for entry in table.between
        if entry.case.fit == key[0]
    ]
    assert max(ratio for ratio in ratios if ratio is not None) == margins(table)[key].factor
    monkeypatch.setattr(calibrated, "LEAST_SCENES", 1000)
    assert margins.__wrapped__(table) == {}
