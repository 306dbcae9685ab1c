"""The study of amplitudes: what is counted, levels by record, the conclusion; the outcome of the stored predictions."""

import hashlib
import json

import numpy as np
import pandas as pd
import pytest

from srbval.path.amplitudes import LEVEL_BANDS, separate_levels
from srbval.recordings.datasets.description import dataset
from srbval.storage.stored_result import newest_result
from srbval.studies.amplitudes.page import unexplained
from srbval.studies.amplitudes.study import FINER, NOMINAL, OWN_PARTS, compare, count_within

# Published before the records were read:
PREDICTIONS = "c0e23fab7f6843579e54abebc40ae0e747f6b06565edb7e9945bab61efa66a91"
KIND = {"locked": "locked level", "harmonic": "harmonic pattern", "total": "total level"}


def row(quantity: str, error: float, *, shown: bool = True, used_for: str = "withheld", record: str = "IR") -> dict:
    """A rig level of -20 dB, or one that is not shown below it, and a model that is off by `error`."""
    own = {"record": record, "quantity": quantity, "kind": KIND[quantity.split()[0]], "used_for": used_for}
    rig = {"rig": -20.0 if shown else -23.0, "least": -20.0, "rig_present": shown, "healthy": -19.0}
    return own | rig | {"reading": 1.0, "mounting": 0.0, "model": -20.0 + error}


def compared(*rows: dict, spread: float = 0.0, draws: int = 16) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Compared rows, and draws of the model that scatter by `spread`."""
    rig, random = pd.DataFrame(rows), np.random.default_rng(1)
    names = list(rig.record + " " + rig.quantity)
    model = dict(zip(names, rig.pop("model"), strict=True))
    drawn = [{name: value + spread * random.standard_normal() for name, value in model.items()} for _ in range(draws)]
    nominal = model | {f"path {name}": 0.0 for name in names}
    found = pd.DataFrame([nominal, model, *drawn]).assign(inputs=[NOMINAL, FINER, *map(str, range(draws))])
    return compare(rig, found), pd.DataFrame(drawn)


def test_a_band_that_is_not_shown_counts_by_the_least_error_that_it_allows():
    rows, _ = compared(
        row("locked 1000 Hz", 3.0),
        row("locked 1259 Hz", -5.0),
        row("locked 1585 Hz", 9.0, used_for="fit"),
        row("locked 1995 Hz", -9.0, shown=False),
        row("locked 2512 Hz", 6.0, shown=False),
        row("harmonic 2", 1.0),
        row("harmonic 3", 1.0, shown=False),
        row("total 1000 Hz", 4.5),
    )
    assert rows.error.tolist()[:5] == [3.0, -5.0, 9.0, 0.0, 6.0]
    assert rows.uncertainty.tolist() == pytest.approx([1.0] * 8)
    harmonics, totals = {"within": 1, "of": 1}, {"within": 0, "of": 1, "healthy_alone": 1}
    assert count_within(rows) == {"locked": {"within": 2, "of": 4}, "harmonics": harmonics, "totals": totals}


def test_a_planted_level_is_unexplained_and_scatter_is_not():
    off = dict(zip(LEVEL_BANDS, (1.0, -1.0, 0.5, -0.5, 0.3, -0.3), strict=False))
    planted = {"OR_353rpm_sample": 0.0, "IR_353rpm_sample": 12.0}
    made = [row(f"locked {band}", db + own, record=name) for name, db in planted.items() for band, own in off.items()]
    rows, drawn = compared(*made, spread=2.0)
    tests, locked = separate_levels(rows, OWN_PARTS, drawn).to_dict("records"), rows.to_dict("records")
    assert [one["level"] for one in tests] == pytest.approx(list(planted.values()), abs=0.5)
    assert "the level of IR 353 (model over rig +11 to +13 dB) is not explained" in unexplained(tests, locked)
    assert unexplained(tests[:1], locked).startswith("In no record")


def test_the_outcome_is_that_of_the_stored_predictions_on_the_published_records():
    predicted, outcome = (newest_result(name) for name in ("predictions", "prediction_outcome"))
    assert predicted is not None
    assert outcome is not None
    text = json.dumps(predicted.content["predictions"], sort_keys=True, separators=(",", ":"))
    assert hashlib.sha256(text.encode()).hexdigest() == outcome.content["predictions_sha256"] == PREDICTIONS
    published = {f"torino/{file['name']}": file["sha256"] for file in dataset("torino-excerpts").files}
    records = {name: one for name, one in outcome.content["inputs_sha256"].items() if name.startswith("torino/")}
    assert records.items() <= published.items()
    assert len(records) == 4
