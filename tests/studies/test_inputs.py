"""The study of inputs: shared draws, failed runs, effects of known size, and the power of the verdicts."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from srbval.bearing import Fault
from srbval.comparison.comparison import STUDY, paper_inputs
from srbval.errors import NumericsError
from srbval.models.run_file import scene_dict
from srbval.scene import changes_at, load_scene, rig_inputs, sobol
from srbval.storage.tables import walk_leaves
from srbval.studies.inputs import study
from tests.comparison.test_verdicts import NAMES, readings, variant

AT = sobol(10, 6)  # draws of all inputs of the paper's scene
DRAWN = 0.1  # relative, of moments over 64 draws
OUTER, INNER = "outer_osculation", "inner_osculation"  # of `line_contact`


def stands_for(monkeypatch: pytest.MonkeyPatch, measures: Any) -> list[pd.DataFrame]:
    """`measures` of every case in place of its run; returns the frames of cases that were asked for."""
    asked = []

    def sweep(cases: pd.DataFrame, *_: Any, **__: Any) -> pd.DataFrame:
        asked.append(cases)
        found = pd.DataFrame([{"status": "ok", "reason": ""} | measures(case) for case in cases.to_dict("records")])
        return pd.concat([cases, found], axis=1)

    monkeypatch.setattr(study, "sweep", sweep)
    return asked


@pytest.mark.parametrize("name", ["paper", "rig"])
def test_every_record_is_run_at_the_same_inputs(name, monkeypatch):
    asked = stands_for(monkeypatch, lambda case: {"ratio": 0.43 + 1e-9 * case["shaft_rpm"]})
    at = sobol(8 if name == "paper" else len(rig_inputs()), 2)
    found = study.cage_draws(name, at)
    of_record = [group["shares"].tolist() for _, group in asked[0].groupby(["state", "nominal_rpm"])]
    assert len(of_record) == len(study.records(study.CAGE_STATES)) == 6
    assert all(shares == of_record[0] for shares in of_record)
    assert [len(one["drawn"]) for one in found["records"]] == [len(at)] * len(of_record)
    assert (found["failed"], len(found["effects"])) == (0, len(at[0]))


def test_a_failed_draw_is_left_out_and_a_failed_nominal_run_is_an_error(monkeypatch):
    at = sobol(len(rig_inputs()), 3)

    def breaks(case: dict[str, Any], where: list[float] | None) -> dict[str, Any]:
        wrong = case["shares"] == (where or case["shares"]) and case["nominal_rpm"] == 353.0
        return {"ratio": np.nan if wrong else 0.43, "reason": "skids" if wrong else ""}

    stands_for(monkeypatch, lambda case: breaks(case, at[3]))
    found = study.cage_draws("rig", at)
    assert (found["failed"], len(found["at"]), {len(one["drawn"]) for one in found["records"]}) == (1, 7, {7})
    stands_for(monkeypatch, lambda case: breaks(case, None))
    with pytest.raises(NumericsError, match="scene rig: a nominal run failed: skids"):
        study.cage_draws("rig", at)


def test_scenes_are_nominal_finer_and_drawn():
    case = study.records(study.CAGE_STATES)[0] | {"turns": 3.0, "finer": False}
    rig = case | {"scene": "rig", "shares": [None] * len(rig_inputs())}
    assert study.scene_of(rig).line_contact == load_scene("rig").line_contact
    assert study.scene_of(rig | {"finer": True}).line_contact.slices > load_scene("rig").line_contact.slices
    case |= {"scene": "paper", "shares": [None] * 8}
    paper, fine = study.scene_of(case), study.scene_of(case | {"finer": True})
    assert (fine.solver.step_s, fine.contact.points_per_circle) == (paper.solver.step_s / 2, 4000)
    drawn = [changes_at(rig_inputs(), row)["line_contact"] for row in sobol(len(rig_inputs()), 6)]
    assert all(0.96 <= one[INNER] <= one[OUTER] <= 0.985 for one in drawn)  # one roller has one profile radius


def test_every_input_of_the_paper_s_scene_changes_it_at_either_end():
    inputs, case = paper_inputs(), study.records([Fault.OUTER])[0] | {"scene": "paper", "turns": 3.0}
    named = {key for each in inputs for key in each.keys}
    assert {"load.path", "contact.critical_velocity_m_s", "defect.extent_m", "band.low_hz"} <= named
    ends = [study.drawn_scene(case | {"shares": [share] * len(inputs)}) for share in (0.0, 0.999, None)]
    low, high, own = (
        dict(walk_leaves(scene_dict(scene))) | dict(zip(("band.low_hz", "band.high_hz"), band, strict=True))
        for scene, band in ends
    )
    assert [key for key in named if low[key] == high[key]] == []
    assert (own["band.low_hz"], own["band.high_hz"]) == (500.0, 1500.0)
    assert high["load.radial_n"] / own["load.radial_n"] == pytest.approx(1.02, rel=1e-4), "a factor"
    assert low["contact.critical_velocity_m_s"] == 1e-3
    assert all(each.source for each in inputs)


def test_effects_are_as_large_as_they_are(monkeypatch):
    """A level that rises by 6 dB over the third input's range and falls by 1 dB over the fifth's."""

    def measures(case: dict[str, Any]) -> dict[str, Any]:
        third, fifth = (0.0 if share is None else share for share in (case["shares"][2], case["shares"][4]))
        level = -3 + 6 * third - fifth + 0.1 * case["finer"]
        return {"values": {"2xBPFO": level, "cage ratio": 0.43} if case["state"] == "outer" else {}}

    stands_for(monkeypatch, measures)
    rows = {row["quantity"]: row for row in study.quantity_effects(AT)}
    level = rows["2xBPFO"]
    assert {row["defect"] for row in rows.values()} == {"outer"}
    assert rows["cage ratio"]["inputs_ci95"] == pytest.approx(0, abs=1e-15)
    assert (level["value"], level["shift"]) == (-3, pytest.approx(2.5, rel=DRAWN))
    assert level["inputs_ci95"] == pytest.approx(0.95 * 3, rel=DRAWN)  # uniform, but for the smaller one
    assert level["grid_ci95"] == pytest.approx(STUDY.grid_factor * 0.1)


def test_the_larger_an_error_the_more_often_it_is_found():
    rows = list(study.power(variant(), readings(), rigs=20))
    assert [(row["endpoint"], row["planted_pct"]) for row in rows] == [(n, p) for n in NAMES for p in study.PLANTED_PCT]
    for name in NAMES:
        none, _, margin, twice = (row for row in rows if row["endpoint"] == name)
        assert none["met"] > none["missed"] <= margin["missed"] < twice["missed"]
        assert all(row["met"] + row["missed"] + row["not_resolved"] == pytest.approx(1) for row in (none, twice))
