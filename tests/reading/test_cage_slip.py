"""A cage that slips by several per cent: its lines are found where the user says so, and not read otherwise."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from srbval.bearing import LARGEST_SLIP, Bearing, load_bearing, with_slip
from srbval.diagnosis.diagnose import diagnose
from srbval.errors import ConfigurationError
from srbval.reading.analyse import Analysis, analyse, bearing_of
from srbval.recordings.speed import stated_speed
from tests.reading.test_shaft_speed import BEARING, record

RPM, COUNT = 1500.0, 24
# BPFI = n (f_r - f_c): what a cage's slip raises it by.
BPFI_SHARE = BEARING.rolling_elements * BEARING.orders.ftf / BEARING.orders.bpfi


def read(bearing: Bearing, *, cage_slip: float, seed: int = 0, fault: bool = True) -> Analysis:
    made = record(shaft_hz=RPM / 60, slip=BPFI_SHARE * cage_slip, seed=seed, fault=fault)
    return analyse(made, bearing=bearing, speed=stated_speed(RPM, 1.0))


def test_a_slip_beyond_the_window_is_read_only_where_it_is_allowed() -> None:
    assert not read(BEARING, cage_slip=0.025).line("BPFI").detected
    found = read(with_slip(BEARING, 3.0), cage_slip=0.025)
    line = found.line("BPFI")
    assert line.detected
    assert line.found_hz == pytest.approx(BEARING.orders.bpfi * RPM / 60 * (1 + 0.025 * BPFI_SHARE), abs=line.ci95_hz)
    assert "3 % for slip" in found.search
    assert found.windows["BPFI"][0] == pytest.approx(0.97 * line.kinematic_hz, rel=1e-3)


def test_intervals_contain_the_line_whatever_the_slip_and_no_fault_is_named_in_noise() -> None:
    rng, bearing = np.random.default_rng(1), with_slip(BEARING, 3.0)
    covered, seen = 0, 0
    named = Counter[str]()
    for seed, slip in enumerate(rng.uniform(0.0, 0.03, COUNT)):
        found = read(bearing, cage_slip=slip, seed=seed)
        line = found.line("BPFI")
        seen += line.detected
        true_hz = BEARING.orders.bpfi * RPM / 60 * (1 + BPFI_SHARE * slip)
        covered += line.detected and abs(line.found_hz - true_hz) <= line.ci95_hz
        named[diagnose(found).state] += 1
    assert seen == COUNT
    assert named["inner"] >= COUNT - 4  # the weakest, at a third to two thirds, remain undecided
    assert set(named) <= {"inner", "undecided"}
    assert covered >= COUNT - 3  # 95 % intervals: fewer with a probability of 3 %
    for seed in range(6):
        assert diagnose(read(bearing, cage_slip=0.0, seed=100 + seed, fault=False)).state in ("healthy", "undecided")


@pytest.mark.parametrize("pct", [0.0, -1.0, 5.1, float("nan")])
def test_an_impossible_slip_is_refused(pct: float) -> None:
    with pytest.raises(ConfigurationError, match="at most 5 %"):
        with_slip(BEARING, pct)


def test_a_bearing_file_may_state_it_and_the_option_overrides_it(tmp_path: Path) -> None:
    path = tmp_path / "light.toml"
    orders = "[orders]\nrolling_elements = 9\nbpfo = 3.585\nbpfi = 5.415\nbsf = 2.357\nftf = 0.398\n"
    path.write_text(f"title = 'a'\nsource = 'b'\nlargest_slip_pct = 3\n{orders}")
    assert load_bearing(path).largest_slip == pytest.approx(0.03)
    made = record(shaft_hz=RPM / 60)
    assert bearing_of(made, str(path), largest_slip_pct=2.0).largest_slip == pytest.approx(0.02)
    assert bearing_of(made).largest_slip == LARGEST_SLIP
    path.write_text(f"title = 'a'\nsource = 'b'\nlargest_slip_pct = 30\n{orders}")
    with pytest.raises(ConfigurationError, match=r"30 %: must be positive and at most 5 %"):
        load_bearing(path)
