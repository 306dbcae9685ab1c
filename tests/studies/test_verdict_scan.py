"""The scan: every input alone over its whole range, the record read otherwise, each compared with the tolerance."""

from types import SimpleNamespace

import numpy as np
import pytest

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.comparison.budget import SCAN, Answer
from srbval.comparison.comparison import QuantityValue, deviation_pct
from srbval.reading.analyse import analyse
from srbval.storage.stored_result import newest_result
from srbval.studies.open_inputs import open_inputs
from srbval.studies.verdict_scan import study as verdict_scan
from srbval.studies.verdict_scan.study import scan

pytestmark = pytest.mark.recordings


@pytest.fixture(scope="module")
def rows(recordings_dir):
    """With a stand-in for runs: the cage ratio a known function of velocity, load and points on a circle."""

    def simulated(scene, **_):
        decades = np.log10(scene.contact.critical_velocity_m_s / 1e-3)
        load = scene.load.radial_n / 124.8e3 - 1
        cage = 0.4308 + 1e-3 * (decades - 1) ** 2 + 1e-3 * load + 1e-2 / scene.contact.points_per_circle
        return SimpleNamespace(cage_ratio=float(cage), status=SimpleNamespace(usable=True))

    def run(scene):
        cage = QuantityValue(value=simulated(scene).cage_ratio)
        return SimpleNamespace(values={"cage ratio": cage}, analysis=analyses[scene.defect.kind])

    analyses = {}

    def analysed(recording, **options):
        found = analyse(recording, **options)
        analyses.setdefault(recording.state, found)
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SRBVAL_RECORDINGS", str(recordings_dir / "torino"))
        patch.setattr(verdict_scan, "run_unchecked", run)
        patch.setattr(verdict_scan, "simulate", simulated)
        patch.setattr(verdict_scan, "analyse", analysed)
        found = scan(newest_result("rig_inputs").content)
    return {(row["scene"], row["defect"], row["name"]): row for row in found}


def test_every_input_is_taken_over_its_whole_range(rows):
    for one in open_inputs():
        row = rows["paper", Fault.OUTER, one.name]
        count = len(one.choices) or (SCAN.log_points if one.log else SCAN.points)
        assert len(row["values"]) == len(row["errors_pct"]) == len(row["answers"]) == count
        ends = one.choices or (f"{one.low:.4g}", f"{one.high:.4g}")
        assert [row["values"][0].split()[0], row["values"][-1].split()[0]] == [ends[0], ends[-1]]


def test_an_effect_that_falls_and_rises_is_seen_between_its_ends(rows):
    nominal = rows["paper", Fault.OUTER, ""]
    row = rows["paper", Fault.OUTER, "critical velocity of friction"]
    assert row["errors_pct"][0] == pytest.approx(nominal["errors_pct"][0])  # nominal is the range's end
    assert min(row["errors_pct"]) < min(row["errors_pct"][0], row["errors_pct"][-1]) - 0.15
    assert set(row["answers"]) == {Answer.MET, Answer.NOT_RESOLVED, Answer.MISSED}
    assert set(rows["paper", Fault.OUTER, "load"]["answers"]) == set(nominal["answers"]) == {Answer.MISSED}


def test_points_on_a_circle_are_scanned_beside_the_papers_own(rows):
    row = rows["paper", Fault.INNER, "points on a circle"]
    assert row["values"] == list(map(str, SCAN.circle_points))
    own = [0.4308 + 1e-3 + 1e-2 / points for points in SCAN.circle_points]
    first = deviation_pct(own[0], own[-1])
    assert row["errors_pct"][0] - row["errors_pct"][-1] == pytest.approx(first, rel=0.01)


def test_the_records_second_comb_is_another_answer_of_the_outer_race_alone(rows):
    """OR 877 shows a comb at order 8.148 between 2.8 and 4.5 kHz, 0.46 % below the one in the paper's band."""
    outer, inner = (rows["paper", fault, "band and comb"] for fault in (Fault.OUTER, Fault.INNER))
    jump = dict(zip(outer["values"], outer["errors_pct"], strict=True))
    assert jump["2800 to 4500 Hz"] - jump["1400 to 2800 Hz"] == pytest.approx(0.46, abs=0.02)
    assert max(inner["errors_pct"]) - min(inner["errors_pct"]) < 0.05


@pytest.mark.parametrize("fault", [Fault.OUTER, Fault.INNER])
def test_how_the_record_is_read_moves_less_than_its_interval(rows, fault):
    for name in ("reading", "kinematics searched about", "shaft speed"):
        row = rows["paper", fault, name]
        for error, u in zip(row["errors_pct"], row["ci95_pct"], strict=True):
            assert abs(error - row["errors_pct"][0]) < np.hypot(u, row["ci95_pct"][0])


def test_the_rig_scene_comes_from_its_own_study(rows):
    study = newest_result("rig_inputs").content["studies"][0]
    for effect in study["effects"]:
        row = rows["rig", Fault.OUTER, effect["key"]]
        own = [deviation_pct(ratio, study["of"]["cage_ratio"]) for ratio in effect["cage_ratios"]]
        assert row["errors_pct"] == pytest.approx(own, abs=0.002)  # read from the shipped, compact record


def test_a_bearing_with_another_last_digit_is_one(tmp_path):
    """The pitch radius and its printed double, the radial place of the inner profile's centre, go together."""
    own = load_bearing(DEFAULT_BEARING).geometry
    names = ("pitch_radius_m", "inner_centre_radial_m")
    moved = load_bearing(verdict_scan._bearing_file(tmp_path, names, SCAN.half_digit_m)).geometry
    assert moved.pitch_radius_m - own.pitch_radius_m == pytest.approx(SCAN.half_digit_m)
    assert moved.inner_centre_radial_m - own.inner_centre_radial_m == pytest.approx(2 * SCAN.half_digit_m)
    assert moved.tilt_rad == own.tilt_rad
    assert load_bearing(verdict_scan._bearing_file(tmp_path, names, 0.0)).geometry == own
