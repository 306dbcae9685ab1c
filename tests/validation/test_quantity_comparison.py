import math
from dataclasses import replace
from types import SimpleNamespace

import pytest

from srbval.recordings import State
from srbval.validation.comparison import ComparisonVerdict
from srbval.validation.lines import Line
from srbval.validation.quantities import quantities
from srbval.validation.quantity_comparison import compare
from srbval.validation.sensitivity import Effect

SHAFT_HZ = 10.0
EFFECT = Effect(
    term="half the step", kind="numerics", source="s", defect="inner", quantity="BPFI", unit="order", base=10.82,
    bound=0.01,
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

    return SimpleNamespace(lines=lines, line=first, speed=SimpleNamespace(value_hz=SHAFT_HZ, ci95_hz=0.001))


def rows(model, rig, effects=(EFFECT,)):
    return {r.quantity: r for r in compare({State.INNER: rig}, {State.INNER: model}, effects)}


def test_quantities_are_the_order_and_levels_over_the_first_harmonic():
    order, second, sides = quantities(analysis(), State.INNER)
    assert (order.name, order.value) == ("BPFI", pytest.approx(10.82))
    assert (second.name, second.value) == ("2xBPFI", pytest.approx(20 * math.log10(0.5)))
    assert (sides.name, sides.value) == ("BPFI sidebands", pytest.approx(20 * math.log10(0.3)))
    # Two amplitudes of 200 times the noise: each scatters by one over the root of 400.
    assert second.ci95 == pytest.approx(1.96 * 8.686 * math.sqrt(2 / 400), rel=1e-3)


def test_error_and_uncertainty_join_numerics_data_and_speed():
    row = rows(analysis(found_hz=108.4), analysis())["BPFI"]
    assert row.error == pytest.approx(100 * 0.2 / 108.2)
    parts = (100 * 0.001 / 10.82, 100 * 0.001 / 10.82, 0.01, 100 * 0.01 / 10.82)
    assert row.uncertainty == pytest.approx(math.hypot(*parts), rel=1e-6)
    assert row.dominant == "numerics: half the step"
    assert row.verdict is ComparisonVerdict.RESOLVED


def test_small_error_is_not_resolved_and_without_terms_the_data_do_not_suffice():
    assert rows(analysis(found_hz=108.25), analysis())["BPFI"].verdict is ComparisonVerdict.NOT_RESOLVED
    assert rows(analysis(), analysis())["2xBPFI"].verdict is ComparisonVerdict.INSUFFICIENT


def test_a_level_that_is_only_noise_is_not_compared():
    level = replace(EFFECT, quantity="2xBPFI", bound=0.1)
    shown = rows(analysis(depth_second=0.1), analysis(), (level,))["2xBPFI"]
    assert shown.verdict is ComparisonVerdict.RESOLVED
    hidden = rows(analysis(depth_second=0.1, detected=False), analysis(), (level,))["2xBPFI"]
    assert hidden.verdict is ComparisonVerdict.INSUFFICIENT
