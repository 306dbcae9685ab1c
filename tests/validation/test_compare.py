"""How quantities are read and compared: levels, the cage ratio, and the verdict on each row."""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest

from srbval.bearing import Fault
from srbval.comparison.compared_quantities import cage_ratio_of_order, read_quantities
from srbval.comparison.comparison import Verdict
from srbval.reading.lines import Line
from srbval.signal import NORMAL_95
from srbval.validation.case import Tolerance, ValidationCase
from srbval.validation.compare import compare_pair, table_of
from srbval.validation.sides import SideReading

PRINTED_RELATIVE = 1e-3  # 1.96 and 8.686 are printed with four digits
EXACT_RELATIVE = 1e-6  # the same sum of squares, in another order
SHAFT_HZ = 10.0
CAGE = {"quantity": "cage ratio", "shift": 0.0, "inputs_ci95": 0.001, "grid_ci95": 0.0}


def analysis(depth_second=0.5, detected=True, found_hz=108.2):
    """An inner-race record of known lines."""
    about = {"kinematic_hz": 108.2, "found_hz": found_hz, "ci95_hz": 0.01, "snr": 200.0}
    first = Line(name="BPFI", harmonic=1, depth=1.0, detected=True, **about)
    lines = [first, replace(first, harmonic=2, found_hz=2 * found_hz, depth=depth_second, detected=detected)]
    lines += [replace(first, name=name, depth=depth) for name, depth in (("BPFI-fr", 0.2), ("BPFI+fr", 0.4))]
    facts = {"bearing": SimpleNamespace(rolling_elements=19), "recording": SimpleNamespace(file="made", name="made")}
    facts["speed"] = SimpleNamespace(value_hz=SHAFT_HZ, ci95_hz=0.001)
    return SimpleNamespace(lines=lines, line_of=lambda _: lines[0], **facts)


def known(*effects):
    return {("inner", one["quantity"]): one for one in effects}


CASE = ValidationCase()


def side(*analyses, scene=None, order=None, state=Fault.INNER):
    values = tuple(read_quantities(one, state, order) for one in analyses)
    return SideReading(analyses=analyses, values=values, scene=scene)


def rows(model, rig, effects=(CAGE,)):
    sides = {"simulated": side(model, scene="paper"), "measured": side(rig)}
    return {row["quantity"]: row for row in compare_pair(1, Fault.INNER, sides, CASE, known(*effects), "withheld")}


def outside(simulated, measured, **case):
    """Table of a comparison with signals from outside, by quantity."""
    own = replace(CASE, **case)
    sides = {"simulated": side(*simulated), "measured": side(*measured)}
    return table_of(list(compare_pair(1, Fault.INNER, sides, own, {}, "withheld")), own.tolerance).set_index("quantity")


def test_quantities_are_the_cage_ratio_and_levels_over_the_first_harmonic():
    values = read_quantities(analysis(), Fault.INNER, None)
    expected = {"BPFI": 10.82, "cage ratio": 1 - 10.82 / 19}
    expected |= {"2xBPFI": 20 * math.log10(0.5), "BPFI sidebands": 20 * math.log10(0.3)}
    assert {name: value.value for name, value in values.items()} == pytest.approx(expected)
    # Two amplitudes of 200 times the noise: each scatters by one over the root of 400.
    assert values["2xBPFI"].ci95 == pytest.approx(1.96 * 8.686 * math.sqrt(2 / 400), rel=PRINTED_RELATIVE)


def test_error_and_uncertainty_join_numerics_data_and_speed():
    row = rows(analysis(found_hz=108.4), analysis())["cage ratio"]
    cage = 1 - 10.82 / 19
    assert row["error"] == pytest.approx(-100 * 0.02 / 19 / cage)  # the faster BPFI, the slower the cage
    speed = 0.001 / SHAFT_HZ * 10.82  # what the shaft's speed does to the line's order
    parts = [100 / cage * part for part in (0.001 / 19, speed / 19, 0.001)]
    assert row["uncertainty"] == pytest.approx(math.hypot(*parts), rel=EXACT_RELATIVE)
    assert (row["state"], row["verdict"]) == ("inner", Verdict.DIFFERS)


def test_small_error_is_not_resolved_unless_surely_small_and_without_terms_the_data_do_not_suffice():
    tight = CAGE | {"inputs_ci95": 0.0002}
    assert rows(analysis(found_hz=108.25), analysis())["cage ratio"]["verdict"] == Verdict.NOT_RESOLVED
    found = rows(analysis(found_hz=108.205), analysis(), (tight,))["cage ratio"]
    assert abs(found["error"]) + found["uncertainty"] < 0.1
    assert found["verdict"] == Verdict.AGREES
    assert rows(analysis(), analysis())["2xBPFI"]["verdict"] == Verdict.INSUFFICIENT


def test_a_level_that_is_only_noise_is_not_compared():
    level = CAGE | {"quantity": "2xBPFI", "inputs_ci95": 0.2}
    shown = rows(analysis(depth_second=0.1), analysis(), (level,))["2xBPFI"]
    assert shown["verdict"] == Verdict.DIFFERS
    assert shown["parts"]["rig mounting"] == pytest.approx(NORMAL_95 * 2.0)
    hidden = rows(analysis(depth_second=0.1, detected=False), analysis(), (level,))["2xBPFI"]
    assert hidden["verdict"] == Verdict.INSUFFICIENT


def test_the_run_s_own_speed_gives_the_model_s_cage():
    sides = {"simulated": side(analysis(found_hz=107.0), scene="rig", order=10.83), "measured": side(analysis())}
    line, row, *_ = compare_pair(1, Fault.INNER, sides, CASE, known(CAGE), "withheld")
    assert (line["kind"], line["model"]) == ("race line", 10.83)
    assert (row["quantity"], row["scene"], row["model"]) == ("cage ratio", "rig", 1 - 10.83 / 19)
    assert list(compare_pair(1, Fault.HEALTHY, sides, CASE, known(CAGE), "withheld")) == []
    of_inner = pytest.approx(cage_ratio_of_order(Fault.INNER, 10.83, 19))
    assert cage_ratio_of_order(Fault.OUTER, 8.17, 19) == of_inner  # one cage, both races


def test_a_stated_uncertainty_of_the_cage_widens_the_inner_race_line_by_less():
    """1 % of c is c / (1 - c) % of BPFI, 0.76 % here, with the opposite sign."""
    table = outside([analysis()], [analysis()], uncertainty=Tolerance(cage_pct=0.3))
    parts = table["parts"].map(lambda parts: parts.get("simulation: stated"))
    cage = 1 - 10.82 / 19
    assert parts["cage ratio"] == 0.3
    assert parts["BPFI"] == pytest.approx(0.3 * cage / (1 - cage))
    assert parts.isna()["harmonic 2"]


def test_the_mean_over_the_inputs_is_compared():
    cage = rows(analysis(), analysis(), (CAGE | {"shift": 0.002},))["cage ratio"]
    assert rows(analysis(), analysis())["cage ratio"]["error"] == 0.0
    assert cage["error"] == pytest.approx(100 * 0.002 / cage["rig"])


def test_repeats_scatter_about_their_mean_by_student_s_t():
    table = outside([analysis(found_hz=hz) for hz in (108.1, 108.2, 108.3)], [analysis()])
    half_hz = 4.302653 * 0.1 / math.sqrt(3)  # Student's t of two degrees of freedom
    assert table.loc["BPFI", "simulated"] == pytest.approx(108.2)
    assert table.loc["BPFI", "simulated_ci95"] == pytest.approx(half_hz, rel=EXACT_RELATIVE)
    assert table.loc["BPFI", "parts"]["simulation: repeats"] == pytest.approx(100 * half_hz / 108.2, rel=EXACT_RELATIVE)
    assert table.loc["BPFI", "verdict"] == Verdict.NOT_RESOLVED


@pytest.mark.parametrize(("off_hz", "verdict"), [(0.0, "met"), (0.9, "missed"), (0.25, "not resolved")])
def test_a_stated_tolerance_is_met_missed_or_not_resolved(off_hz, verdict):
    limits = {"tolerance": Tolerance(cage_pct=0.3), "uncertainty": Tolerance(cage_pct=0.1)}
    table = outside([analysis(found_hz=108.2 + off_hz)], [analysis()], **limits)
    assert table.loc["cage ratio", "verdict"] == verdict
    assert table.loc["BPFI", "verdict"] in ("agrees", "differs", "not resolved")  # the tolerance is the cage's


def test_lines_at_different_speeds_are_compared_in_orders():
    slower = analysis(found_hz=100.0)
    slower.speed = SimpleNamespace(value_hz=SHAFT_HZ * 100.0 / 108.2, ci95_hz=0.0)
    row = outside([slower], [analysis()]).loc["BPFI"]
    assert (row["unit"], row["error"]) == ("order", pytest.approx(0.0, abs=EXACT_RELATIVE))
    assert (row["simulated_hz"], row["measured_hz"]) == pytest.approx((100.0, 108.2))
    assert outside([analysis()], [analysis()]).loc["BPFI", "unit"] == "Hz"


def test_what_one_side_alone_shows_is_a_row_without_an_error():
    silent = analysis()
    silent.lines = [replace(line, depth=None) if line.harmonic == 2 else line for line in silent.lines]
    row = outside([silent], [analysis()]).loc["harmonic 2"]
    assert (row["simulated"], row["error"], row["verdict"]) == (None, None, Verdict.INSUFFICIENT)
    assert row["measured"] == pytest.approx(20 * math.log10(0.5))
