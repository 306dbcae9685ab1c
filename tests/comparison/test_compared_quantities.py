import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.comparison import compared_quantities
from srbval.comparison.compared_quantities import (
    COMPARED,
    HARMONIC,
    PRESENCE,
    ComparedQuantity,
    cage_of,
    compare,
    difference,
    mean_of_starts,
    own_effects,
    values_of_model,
)
from srbval.comparison.comparison import ComparisonVerdict, QuantityValue
from srbval.comparison.effects import INPUTS, DefectEffects, QuantityEffects, Sensitivity
from srbval.reading.lines import Line
from srbval.signal import NORMAL_95

PRINTED_RELATIVE = 1e-3  # 1.96 and 8.686 are printed with four digits
EXACT_RELATIVE = 1e-6  # the same sum of squares, in another order

SHAFT_HZ = 10.0
CAGE = QuantityEffects(
    name="cage ratio", unit="1", value=0.4305, shift=0.0, deviation=0.0005, shares={}, grid_ci95=0.0, paper_points=None,
    paper_points_ci95=None, start_sd=0.0, paper_start_sd=None, outside=0.0,
)  # fmt: skip


def analysis(depth_second=0.5, detected=True, found_hz=108.2):
    def line(name, harmonic, depth, shown=True):
        return Line(
            name=name, harmonic=harmonic, kinematic_hz=108.2, found_hz=harmonic * found_hz, ci95_hz=0.01, snr=200.0,
            depth=depth, detected=shown,
        )  # fmt: skip

    lines = [line("BPFI", 1, 1.0), line("BPFI", 2, depth_second), line("BPFI-fr", 1, 0.2), line("BPFI+fr", 1, 0.4)]
    lines[1] = replace(lines[1], detected=detected)

    def first(name, harmonic=1):
        return next(x for x in lines if (x.name, x.harmonic) == (name, harmonic))

    # Too short for a spectrum's shape: that has its own test.
    short = SimpleNamespace(band_hz=(500.0, 1500.0), squared=np.ones(100), squared_fs_hz=2000.0)
    speed = SimpleNamespace(value_hz=SHAFT_HZ, ci95_hz=0.001)
    recording = SimpleNamespace(file="made", name="made")
    return SimpleNamespace(
        lines=lines, line=first, line_of=lambda fault: first(fault.line), speed=speed, processed=short,
        recording=recording, bearing=SimpleNamespace(rolling_elements=19),
    )  # fmt: skip


def known(*effects):
    # Two draws, each two deviations off: so is the half width.
    values = [[one.value + one.shift + sign * 2 * one.deviation for one in effects] for sign in (-1, 1)]
    own = DefectEffects(
        defect="inner", quantities=effects, draws=2, failed=0, refined=False, predicted=values,
    )  # fmt: skip
    return Sensitivity(defects=(own,))


def rows(model, rig, effects=(CAGE,)):
    values = values_of_model(model, Fault.INNER, None)
    return {r.quantity: r for r in compare(Fault.INNER, rig, values, known(*effects))}


def test_quantities_are_the_cage_ratio_and_levels_over_the_first_harmonic():
    fault = Fault.INNER
    values = {row.name_of(fault): row.read(analysis(), fault) for row in COMPARED if row.effects is own_effects}
    assert {name: value.value for name, value in values.items() if value is not None} == {
        "cage ratio": pytest.approx(1 - 10.82 / 19),
        "2xBPFI": pytest.approx(20 * math.log10(0.5)),
        "BPFI sidebands": pytest.approx(20 * math.log10(0.3)),
    }
    # Two amplitudes of 200 times the noise: each scatters by one over the root of 400.
    assert values["2xBPFI"].ci95 == pytest.approx(1.96 * 8.686 * math.sqrt(2 / 400), rel=PRINTED_RELATIVE)


def test_error_and_uncertainty_join_numerics_data_and_speed():
    row = rows(analysis(found_hz=108.4), analysis())["cage ratio"]
    cage = 1 - 10.82 / 19
    assert row.error == pytest.approx(-100 * 0.02 / 19 / cage)  # the faster BPFI, the slower the cage
    speed = 0.001 / SHAFT_HZ * 10.82  # what the shaft's speed does to the line's order
    parts = [100 / cage * part for part in (0.001 / 19, 0.001 / 19, speed / 19, 2 * 0.0005)]
    assert row.uncertainty == pytest.approx(math.hypot(*parts), rel=EXACT_RELATIVE)
    assert row.dominant == INPUTS
    assert row.verdict is ComparisonVerdict.RESOLVED


def test_small_error_is_undecided_unless_surely_small_and_without_terms_the_data_do_not_suffice():
    tight = replace(CAGE, deviation=0.0001)
    assert rows(analysis(found_hz=108.25), analysis())["cage ratio"].verdict is ComparisonVerdict.UNDECIDED
    found = rows(analysis(found_hz=108.205), analysis(), (tight,))["cage ratio"]
    assert abs(found.error) + found.uncertainty < 0.1
    assert found.verdict is ComparisonVerdict.AGREES
    assert rows(analysis(), analysis())["2xBPFI"].verdict is ComparisonVerdict.INSUFFICIENT


def test_the_mean_over_the_inputs_is_compared():
    shifted = replace(CAGE, shift=0.002)
    plain, moved = (rows(analysis(), analysis(), (one,))["cage ratio"] for one in (CAGE, shifted))
    assert (plain.error, moved.error) == (0.0, pytest.approx(100 * 0.002 / plain.rig.value))


def test_values_are_means_over_starts_with_student_s_interval():
    members = [{"2xBPFI": QuantityValue(value=v, present=v > 1, least=-v)} for v in (1.0, 2.0, 3.0, 4.0)]
    (mean,) = mean_of_starts(members).values()
    assert mean.value == 2.5
    assert mean.ci95 == pytest.approx(3.182446 * np.std([1, 2, 3, 4], ddof=1) / 2, rel=EXACT_RELATIVE)
    assert (mean.present, mean.least) == (True, -1.0)
    assert mean_of_starts([*members, {}]) == {}  # what one start does not show has no mean
    assert mean_of_starts(members[:1]) == members[0]


def test_a_level_that_is_only_noise_is_not_compared():
    level = replace(CAGE, name="2xBPFI", unit="dB", deviation=0.1)
    shown = rows(analysis(depth_second=0.1), analysis(), (level,))["2xBPFI"]
    assert shown.verdict is ComparisonVerdict.RESOLVED
    assert shown.parts["rig mounting"] == pytest.approx(NORMAL_95 * 2.0)
    hidden = rows(analysis(depth_second=0.1, detected=False), analysis(), (level,))["2xBPFI"]
    assert hidden.verdict is ComparisonVerdict.INSUFFICIENT


def sided(*, snr, depth, shown):
    """An analysis whose sidebands have this depth, power over noise and presence."""
    made = analysis()
    lines = [
        replace(x, snr=snr, depth=depth, detected=shown) if x.name in ("BPFI-fr", "BPFI+fr") else x for x in made.lines
    ]
    return SimpleNamespace(**{**vars(made), "lines": lines})


@pytest.mark.parametrize(
    ("model", "verdict"),
    [
        (sided(snr=100.0, depth=0.3, shown=True), ComparisonVerdict.UNDECIDED),
        # Noise so low that sidebands a tenth as high would have shown ...
        (sided(snr=5.0, depth=0.02, shown=False), ComparisonVerdict.RESOLVED),
        # ... or so high that those of the rig would not.
        (sided(snr=5.0, depth=0.3, shown=False), ComparisonVerdict.INSUFFICIENT),
    ],
)
def test_missing_sidebands_count_where_they_would_have_shown(model, verdict):
    row = rows(model, sided(snr=100.0, depth=0.3, shown=True))["BPFI sidebands: shown"]
    assert row.kind == PRESENCE.name
    assert row.rig.value == 1.0
    assert row.error == row.model.value - 1.0
    assert row.verdict is verdict


def test_the_run_s_own_speed_gives_the_model_s_cage():
    values = values_of_model(analysis(found_hz=107.0), Fault.INNER, 10.83)
    row = compare(Fault.INNER, analysis(), values, known(CAGE), scene="rig")[0]
    assert row.to_dict()["scene"] == "rig"
    assert (row.quantity, row.model.value) == ("cage ratio", 1 - 10.83 / 19)
    assert row.parts["model: mean of starts"] == 0.0
    assert compare(Fault.HEALTHY, analysis(), values, known(CAGE)) == ()


def test_a_row_is_all_that_a_new_quantity_needs(monkeypatch):
    row = ComparedQuantity(
        kind=HARMONIC[2], name="{line} depth", unit="dB", effects=own_effects, compare=difference,
        read=lambda analysis, fault: QuantityValue(value=20 * math.log10(analysis.line_of(fault).depth)),
    )  # fmt: skip
    monkeypatch.setattr(compared_quantities, "COMPARED", (*COMPARED, row))
    (found,) = (r for q, r in rows(analysis(), analysis()).items() if q == "BPFI depth")
    assert (found.kind, found.unit, found.error) == ("harmonic 2", "dB", 0.0)


def test_slip_moves_both_race_lines_to_one_cage_ratio():
    """A cage at 0.43 of the shaft's speed: BPFO = 8.17 and BPFI = 10.83 orders of 19 rollers tell the same."""
    assert cage_of(Fault.OUTER, 8.17, 19) == pytest.approx(0.43)
    assert cage_of(Fault.INNER, 10.83, 19) == pytest.approx(0.43)
