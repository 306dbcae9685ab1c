"""Posterior probabilities of classes from records of known state."""

import numpy as np
import pytest

from srbval.diagnosis.fault_posterior import CLASSES, OTHER, UNDECIDED, KnownFeatures, decide, fit_posterior

PARTS = ("outer", "inner", "roller")


def known(seed: int = 1) -> list[KnownFeatures]:
    """Six rigs, two bearings of each class on each; own families at 12, silent ones at 0, unexplained combs at 8."""
    rng = np.random.default_rng(seed)
    found = []
    for rig in range(6):
        for state in CLASSES:
            for bearing in range(2):
                families = [
                    max(-1.0, float(rng.normal(12, 3) if state == part else rng.normal(0, 0.7))) for part in PARTS
                ]
                unexplained = float(rng.normal(8, 2) if state == OTHER else rng.normal(1.5, 0.7))
                found.append(
                    KnownFeatures(
                        rig=f"r{rig}", specimen=f"{state}{bearing}", state=state, families=tuple(families),
                        unexplained=unexplained,
                    )
                )  # fmt: skip
    return found


MODEL = fit_posterior(known())


@pytest.mark.parametrize(
    ("features", "state"),
    [((12, -1, -1, 1.5), "outer"), ((-1, 11, -1, 1.5), "inner"), ((-1, -1, 9, 1.5), "roller"),
     ((0, 0, 0, 1.5), "healthy"), ((0, 0, 0, 9), OTHER)],
)  # fmt: skip
def test_clear_records_are_called(features: tuple[float, ...], state: str) -> None:
    shares = MODEL.probabilities(np.array(features, dtype=float))
    assert sum(shares.values()) == pytest.approx(1)
    assert decide(shares) == state


def outer_at(share: float) -> np.ndarray:
    """Features at which the outer race's probability is `share`."""
    values = np.linspace(0, 12, 60)
    shares = [MODEL.probabilities(np.array([x, -1, -1, 1.5]))["outer"] for x in values]
    return np.array([np.interp(share, shares, values), -1, -1, 1.5])


def test_between_the_classes_nothing_is_called() -> None:
    """Between a silent and a faulty part the probability rises through one half."""
    assert decide(MODEL.probabilities(outer_at(0.5))) == UNDECIDED
    assert decide(MODEL.probabilities(outer_at(0.75))) == "outer"


def test_no_probability_is_above_what_so_many_bearings_can_show() -> None:
    few = fit_posterior(
        [k for k in known() if k.state != "outer" or (k.rig in ("r0", "r1") and k.specimen.endswith("0"))]
    )
    assert few.specimens["outer"] == 2
    sure = few.probabilities(np.array([14.0, -1, -1, 1.0]))
    assert sure["outer"] == pytest.approx(2.5 / 3)
    assert sum(sure.values()) == pytest.approx(1)


def test_a_class_shown_by_one_of_several_channels_is_called_and_the_others_are_paid_for() -> None:
    shown, silent = np.array([14.0, -1, -1, 0.5]), np.array([-1.0, -1, -1, 0.5])
    alone, several = MODEL.log_likelihood(shown), MODEL.log_likelihood(shown, silent, silent)
    assert several["outer"] == pytest.approx(alone["outer"] - np.log(3), abs=0.1)
    assert decide(MODEL.probabilities(silent, shown, silent)) == "outer"
    same = MODEL.probabilities(silent, silent, silent)
    assert same == pytest.approx(MODEL.probabilities(silent))


def test_a_class_that_mostly_hides_is_not_excluded_by_silence() -> None:
    """Four of five rollers silent: silence costs them little, and one that shows is called all the same."""
    rng = np.random.default_rng(2)
    hiding = [
        KnownFeatures(**vars(k) | {"families": (k.families[0], k.families[1], -1.0)})
        if k.state == "roller" and rng.random() < 0.8 else k
        for k in known()
    ]  # fmt: skip
    model, silent = fit_posterior(hiding), np.array([-1.0, -1, -1, 0.5])
    assert 0.6 < model.classes["roller"].hidden < 0.95
    found = model.probabilities(silent)
    assert found["roller"] > 2 * found["outer"]
    assert decide(model.probabilities(np.array([-1.0, -1, 12, 0.5]))) == "roller"
