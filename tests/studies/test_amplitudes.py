"""The study of amplitudes: what is counted, and how; what became of the stored predictions."""

import hashlib
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.comparison.budget import VERDICT
from srbval.comparison.comparison import RIG_READING, Comparison, QuantityValue
from srbval.path.amplitudes import THIRD_OCTAVES
from srbval.recordings.datasets.description import dataset
from srbval.storage.stored_result import newest_result
from srbval.studies.amplitudes.counts import ceiling, counts
from srbval.studies.amplitudes.study import INPUTS, band_row
from srbval.studies.amplitudes.study import tested_apart as level_apart
from srbval.studies.rig_amplitudes import rows


def compared(quantity: str, error: float, *, shown: bool = True, used_for: str = "withheld") -> Comparison:
    """A row of a rig's level of -20 dB, or of one that is not shown below that."""
    rig = QuantityValue(value=-20.0 if shown else -23.0, least=-20.0, present=shown, halves=np.array([-20.5, -19.0]))
    model = {quantity: QuantityValue(value=-20.0 + error)}
    (row,) = rows({quantity: rig}, model, {}, record="IR", fault=Fault.INNER, used_for=used_for)
    return row


def test_a_band_that_is_not_shown_counts_by_the_least_error_that_it_allows() -> None:
    assert compared("locked 1000 Hz", -9.0, shown=False).error == 0.0
    assert compared("locked 1000 Hz", 6.0, shown=False).error == 6.0
    found = [
        compared("locked 1000 Hz", 3.0), compared("locked 1259 Hz", -5.0),
        compared("locked 1585 Hz", 9.0, used_for="fit"),
        compared("locked 1995 Hz", -9.0, shown=False), compared("locked 2512 Hz", 6.0, shown=False),
        compared("harmonic 2", 1.0), compared("harmonic 3", 1.0, shown=False), compared("total 1000 Hz", 4.5),
    ]  # fmt: skip
    assert counts(found, {"IR": {"total 1000 Hz": -19.0}}) == {
        "locked": {
            "within": 2, "of": 4, "shown": {"within": 1, "of": 2}, "halves": {"within": 2, "of": 2}, "ceiling": 4
        },
        "harmonics": {"within": 1, "of": 1},
        "totals": {"within": 0, "of": 1, "healthy_alone": 1, "ceiling": 1},
    }  # fmt: skip
    row = band_row(found[3])
    assert (row["censored"], row["rig_db"], row["halves_db"]) == (True, -20.0, 1.5)


def test_the_ceiling_is_that_of_the_best_gain_of_each_band_for_all_records_at_once() -> None:
    band = [compared("locked 1000 Hz", error) for error in (9.0, 2.0, -5.5)]
    assert ceiling(band[:2], {}) == 2  # 7 dB apart
    assert ceiling(band, {}) == 2
    assert ceiling([*band, compared("locked 1259 Hz", 30.0)], {}) == 3
    hidden = compared("locked 1000 Hz", 9.0, shown=False)
    assert ceiling([hidden, compared("locked 1000 Hz", 9.0), compared("locked 1000 Hz", 16.0)], {}) == 3
    total = compared("total 1000 Hz", 9.0)
    assert ceiling([total], {"IR": {"total 1000 Hz": -17.0}}) == 1  # without the model within 3 dB
    assert ceiling([total], {"IR": {"total 1000 Hz": -15.0}}) == 0  # no gain takes the healthy power away


def test_ratios_are_compared_in_logarithms() -> None:
    for factor in (0.5, 2.0):
        rig, model = ({"depth": QuantityValue(value=value, ci95=1.0)} for value in (50.0, 50.0 * factor))
        (row,) = rows(rig, model, {}, record="IR", fault=Fault.INNER, used_for="withheld")
        assert row.error == pytest.approx(100 * math.log(factor))
        assert row.parts == {RIG_READING: 2.0}


def test_few_draws_make_a_pattern_less_improbable_than_theory_says() -> None:
    """Of eight bands: theory takes the covariance as known, which it is of many draws and not of 12."""
    names = [f"locked {band}" for band in THIRD_OCTAVES][:8]
    off = [4.0, -4.0, 3.0, -3.0, 2.0, -2.0, 1.0, -1.0]
    found = [replace(compared(*of), parts={INPUTS: 1.0, RIG_READING: 1.0}) for of in zip(names, off, strict=True)]
    ratio = {}
    for draws in (12, 1000):
        levels = np.random.default_rng(3).normal(-20.0, 2.0, (draws, 8)).tolist()
        result = level_apart(found, [dict(zip(names, row, strict=True)) for row in levels])
        assert result is not None
        ratio[draws] = result["pattern_p"] / result["normal_p"][1]
    assert ratio[12] > 2
    assert ratio[1000] == pytest.approx(1.0, abs=0.3)


PREDICTIONS = (
    "c0e23fab7f6843579e54abebc40ae0e747f6b06565edb7e9945bab61efa66a91"  # printed before the records were opened
)


def test_the_outcome_is_that_of_the_stored_predictions_on_the_published_records() -> None:
    predicted, outcome = (newest_result(name) for name in ("predictions", "prediction_outcome"))
    assert predicted is not None
    assert outcome is not None
    text = json.dumps(predicted.content["predictions"], sort_keys=True, separators=(",", ":"))
    assert hashlib.sha256(text.encode()).hexdigest() == outcome.content["predictions_sha256"] == PREDICTIONS
    published = {f"torino/{file.name}": file.sha256 for file in dataset("torino-excerpts").files}
    records = {name: one for name, one in outcome.content["inputs_sha256"].items() if name.startswith("torino/")}
    assert records.items() <= published.items()
    assert len(records) == 4
    rows = outcome.content["comparisons"]
    values = {
        (one["state"], name): value for one in predicted.content["predictions"] for name, value in one["values"].items()
    }
    assert {(row["state"], row["quantity"]): row["model"] for row in rows} == values
    octaves = [row for row in rows if row["quantity"] in THIRD_OCTAVES and row["rig_present"]]
    (counted,) = (one for one in outcome.content["counts"] if one["kind"] == "third octaves")
    near = sum(abs(row["model"] - row["rig"]) <= VERDICT.near_db for row in octaves)
    assert (counted["within"], counted["of"]) == (near, len(octaves))
    assert predicted.stale is outcome.stale is None
