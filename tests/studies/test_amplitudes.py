"""The study of amplitudes: what is counted, and paths that are drawn; what became of the stored predictions."""

import hashlib
import json

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.comparison.budget import VERDICT
from srbval.comparison.comparison import QuantityValue
from srbval.path.amplitudes import THIRD_OCTAVES, levels
from srbval.recordings import Origin, Recording
from srbval.recordings.datasets.description import dataset
from srbval.report.pages import results_of
from srbval.storage.stored_result import newest_result
from srbval.studies.amplitudes.page import PAGE
from srbval.studies.amplitudes.study import _shares
from srbval.studies.rig_amplitudes import DIRECTION, rows, turned


def test_only_what_the_record_shows_is_counted() -> None:
    rig = {
        "1000 Hz": QuantityValue(value=-20.0), "1259 Hz": QuantityValue(value=-20.0),
        "1585 Hz": QuantityValue(value=-20.0, present=False), "harmonic 2": QuantityValue(value=-3.0),
    }  # fmt: skip
    model = {"1000 Hz": -17.0, "1259 Hz": -25.0, "1585 Hz": 0.0, "harmonic 2": -3.5}
    shown = {name: QuantityValue(value=value) for name, value in model.items()}
    compared = rows(rig, shown, {}, record="IR", fault=Fault.INNER, used_for="withheld")
    octaves, harmonics = _shares(compared, "path")
    names = ("kind", "used_for", "resolved", "near", "mean_error")
    assert [octaves[name] for name in names] == ["third octaves", "withheld", 2, 1, -1.0]
    assert octaves["crps"] == pytest.approx(4.0)  # of points: 3 and 5 dB off
    assert [harmonics[name] for name in names] == ["harmonic pattern", "withheld", 1, 1, -0.5]


def test_turned_phases_keep_every_level_and_draw_pulses_out() -> None:
    pulses = np.zeros(20_480)
    pulses[::205] = 1.0  # a line of 99.9 Hz
    record = Recording(
        name="pulses", channels={"sensor": pulses}, channel="sensor", fs_hz=20_480.0, unit="m/s2", dataset="test",
        origin=Origin.SIMULATED,
    )  # fmt: skip
    drawn_out = turned(record, 20_480 / 205, seed=1)
    for name, level in levels(drawn_out, None).items():
        assert level.value == pytest.approx(levels(record, None)[name].value, abs=0.3)
    assert np.abs(drawn_out.channels["sensor"]).max() < 0.5


def test_the_sidebands_that_gave_the_direction_are_fitted_and_nothing_else_of_that_record() -> None:
    rig = {name: QuantityValue(value=-3.0) for name in ("sidebands 1", "harmonic 2", "1585 Hz")}
    for record, own in ((DIRECTION, "fit"), ("IR_353rpm_sample", "withheld")):
        used = [row.used_for for row in rows(rig, rig, {}, record=record, fault=Fault.INNER, used_for="withheld")]
        assert used == [own, "withheld", "withheld"]


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


def test_the_outcome_stands_first_on_its_page_and_begins_with_what_missed() -> None:
    (first, *_) = PAGE.section(results_of([PAGE])).blocks
    counts = newest_result("prediction_outcome").content["counts"]  # type: ignore[union-attr]
    places = [first.text.index(f"{one['kind']} {one['within']} of {one['of']}") for one in counts]  # type: ignore[union-attr]
    assert places == sorted(places)
    shares = [one["within"] / one["of"] for one in counts]
    assert shares == sorted(shares)
    assert "is blind any more" in first.text  # type: ignore[union-attr]
