"""The study of the reading in short: the same code, few records."""

import math

import numpy as np
import pandas as pd
import pytest

from srbval.progress import silent
from srbval.studies.reading import records, study

THREE_DIGITS = 1e-3  # of the constant sqrt(6) / (2 pi) = 0.390
VARIANCE_SCATTER = 0.05  # of 20,000 samples, with a wide margin


def test_the_records_are_as_stated():
    record = records.comb(np.random.default_rng(2), 10.0, 40.0, 0.0).samples
    power = sum(amplitude**2 for amplitude in records.AMPLITUDES) / 2
    assert np.var(record) == pytest.approx(power + record.size / 4 / 1e4, rel=VARIANCE_SCATTER)
    information = 10**1.6 * sum((h * a) ** 2 for h, a in enumerate(records.AMPLITUDES, 1))
    assert records.bound_hz(10.0, 16.0) == pytest.approx(0.390 / (10 * math.sqrt(information)), rel=THREE_DIGITS)


def test_the_stated_probability_allows_for_another_bearing_and_no_fault_is_named(monkeypatch):
    found = study.background("foreign", 2)
    assert found["named"] == 0
    assert found["placebos"] > 10
    assert found["stated_below"] <= found["rank_below"] < found["noise_below"]
    monkeypatch.setattr(study, "HEALTHY_PLACEBOS", 4)
    assert study.healthy(study.HEALTHY[1])["named"] == 0


def test_every_cell_background_and_healthy_record_has_its_row(monkeypatch):
    monkeypatch.setattr(study, "in_processes", lambda function, items, **_: ((one, function(one)) for one in items))
    monkeypatch.setattr(study, "row_of", lambda task: {"function": task[0].__name__})
    content = study.run(pd.Series({"jobs": 1}), silent).content
    assert [len(rows) for rows in content.values()] == [len(records.BACKGROUNDS) + len(study.HEALTHY), len(study.CELLS)]
