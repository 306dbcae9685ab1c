"""Identifying the path to the sensor: on simulated truth, its intervals, what is rejected, and bad input."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.cli import main
from srbval.errors import ConfigurationError, DataError
from srbval.path.identify import Identified, band_powers, identify, identify_response
from srbval.path.path_fit import best_of, fit_path, inflated
from srbval.recordings.frf import read_frf
from srbval.studies.simulated_rig import BEARING, TRUE, SimulatedRig, behind, record, ring, simulated_rig

BAND_HZ = (400.0, 3150.0)
BIAS_DB = 0.5  # the most that the mean over the band may be off
WITHIN_U = 4.0  # of their own u, parameters of one draw; the share of levels within 2 u is the calibrator's
FREQUENCY_HZ = np.linspace(450, 3000, 200)
EXACT = 1e-3  # of a response without noise, through its least error


@pytest.fixture(scope="module")
def rig() -> SimulatedRig:
    return simulated_rig(1)


@pytest.fixture(scope="module")
def found(rig: SimulatedRig) -> Identified:
    return identify(rig.fault, rig.healthy, rig.excitation, bearing=BEARING)


def test_a_known_path_is_found(found: Identified) -> None:
    assert len(found.path.modes) == len(TRUE.modes)
    modes = sorted(found.path.modes, key=lambda mode: mode.frequency_hz)
    for mode, true in zip(modes, TRUE.modes, strict=True):
        assert mode.frequency_hz == pytest.approx(true.frequency_hz, rel=0.03)
    level, _ = found.path.level_db(FREQUENCY_HZ)
    true_level, _ = TRUE.level_db(FREQUENCY_HZ)
    assert abs(np.mean(level - true_level)) < BIAS_DB


def test_parameters_are_as_sure_as_they_say(found: Identified) -> None:
    order = np.argsort([mode.frequency_hz for mode in found.path.modes])
    places = [0, *(1 + 3 * i + j for i in order for j in range(3))]
    off = np.abs(found.path.parameters[places] - TRUE.parameters) / found.path.deviations()[places]
    assert off.max() < WITHIN_U


def test_the_right_path_passes_and_a_wrong_one_or_a_wrong_size_is_rejected(rig: SimulatedRig) -> None:
    data = band_powers(rig.fault, rig.healthy, rig.excitation, bearing=BEARING, band_hz=BAND_HZ)
    moved = tuple(dataclasses.replace(mode, frequency_hz=1.1 * mode.frequency_hz) for mode in TRUE.modes)
    assert data.chance(TRUE, 1.0) > 0.01
    assert data.chance(dataclasses.replace(TRUE, modes=moved), 1.0) < 1e-6
    assert data.chance(dataclasses.replace(TRUE, modes=()), 1.0) < 1e-6
    twice = simulated_rig(1, size=2.0)  # a defect that strikes twice as hard
    data = band_powers(twice.fault, twice.healthy, twice.excitation, bearing=BEARING, band_hz=BAND_HZ)
    assert data.chance(TRUE, 1.0) < 1e-6


@pytest.mark.slow
def test_with_waves_on_races_and_rollers_too() -> None:
    """Runs of the scene `rig`, 28 nm on each bearing; forces known to 2.4 dB, what its calibrator finds waves to do."""
    known = {size: record("smooth", Fault.OUTER, ring(Fault.OUTER, size=size)) for size in (1.0, 1.5)}
    random = np.random.default_rng(1)
    fault, healthy = (
        behind(record("rough", state, ring(state, 28.0, seed)), random, 0.05)
        for seed, state in enumerate((Fault.OUTER, Fault.HEALTHY))
    )
    right, wrong = (band_powers(fault, healthy, run, bearing=BEARING, band_hz=BAND_HZ) for run in known.values())
    assert right.chance(TRUE, 2.4) > 0.01
    assert right.chance(dataclasses.replace(TRUE, modes=()), 2.4) < 0.01
    assert wrong.chance(TRUE, 2.4) < 1e-6


def test_no_mode_is_found_where_there_is_none() -> None:
    plain = simulated_rig(2, path=dataclasses.replace(TRUE, modes=()))
    path = identify(plain.fault, plain.healthy, plain.excitation, bearing=BEARING).path
    assert path.modes == ()
    assert path.direct == pytest.approx(TRUE.direct, rel=0.06)  # half a decibel


def test_a_healthy_record_with_its_mode_elsewhere_makes_it_less_sure(found: Identified) -> None:
    fit = best_of(found.trials)
    assert len(found.healthy_ratios) == len(found.path.modes)
    moved = fit.parameters.copy()
    moved[1] += 20 * math.sqrt(2 * fit.covariance[1, 1])
    wider, ratios = inflated(fit, dataclasses.replace(fit, parameters=moved))
    assert ratios[0] == pytest.approx(20)
    assert 2 * math.sqrt(wider.covariance[1, 1]) == pytest.approx(moved[1] - fit.parameters[1])
    assert np.linalg.eigvalsh(wider.covariance).min() > -1e-12
    same, _ = inflated(fit, fit)
    assert np.array_equal(same.covariance, fit.covariance)


def written(path: Path, values: np.ndarray, header: str = "frequency_hz,real_m_s2_n,imag_m_s2_n") -> Path:
    rows = [f"{f!r},{v.real!r},{v.imag!r}" for f, v in zip(FREQUENCY_HZ.tolist(), values.tolist(), strict=True)]
    path.write_text("\n".join([header, *rows]), encoding="utf-8")
    return path


def test_a_measured_response_from_a_table_and_from_uff(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    values = TRUE.response(FREQUENCY_HZ) / 92.0
    noisy = values + np.random.default_rng(1).normal(0, 1e-5, (values.size, 2)) @ [1, 1j]
    table = written(tmp_path / "hammer.csv", noisy)
    assert main(["identify", str(table), "--mass-kg", "92", "-o", str(tmp_path / "path.toml"), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [mode["frequency_hz"] for mode in document["modes"]] == pytest.approx([880.0, 1650.0], rel=EXACT)
    assert [mode["gain"] for mode in document["modes"]] == pytest.approx([0.35, 0.5], rel=0.01)  # their signs too
    pyuff = pytest.importorskip("pyuff")
    one = {
        "type": 58, "func_type": 4, "x": FREQUENCY_HZ, "data": noisy, "rsp_node": 1, "rsp_dir": 3, "ref_node": 1,
        "ref_dir": 3, "rsp_ent_name": "sensor", "ref_ent_name": "seat", "id1": "hammer", "abscissa_spacing": 0,
        "abscissa_spec_data_type": 18, "ordinate_spec_data_type": 12, "orddenom_spec_data_type": 13,
    }  # fmt: skip
    pyuff.UFF(str(tmp_path / "hammer.uff")).write_sets(one, "overwrite")
    frequency_hz, read = read_frf(tmp_path / "hammer.uff")
    assert frequency_hz == pytest.approx(FREQUENCY_HZ, rel=1e-5)
    assert np.allclose(read, noisy, rtol=1e-4)
    monkeypatch.setattr("pyuff.UFF", None)  # in this process: the library reads in another one, with limits
    whole = (tmp_path / "hammer.uff").read_text()
    (tmp_path / "hammer.uff").write_text(whole.replace(" 1.", " x."))
    with pytest.raises(DataError, match=r"hammer\.uff: truncated or damaged universal file"):
        read_frf(tmp_path / "hammer.uff")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("f,re,im\n1,2,3\n2,2,3", "columns must be"),
        ("frequency_hz,real_m_s2_n,imag_m_s2_n\n1,2,3", "two or more"),
        ("frequency_hz,real_m_s2_n,imag_m_s2_n\n1,2,3\n1,2,3", "must rise"),
        ("frequency_hz,real_m_s2_n,imag_m_s2_n\n1,2,nan\n2,2,3", "finite"),
        ("frequency_hz,real_m_s2_n,imag_m_s2_n\n1,2,x\n2,2,3", "not a table"),
        ("", "not a table"),
    ],
)
def test_what_is_no_response_is_refused(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "bad.csv").write_text(text, encoding="utf-8")
    with pytest.raises(DataError, match=said):
        read_frf(tmp_path / "bad.csv")


def test_too_few_lines_of_a_response() -> None:
    with pytest.raises(DataError, match="at least"):
        identify_response(FREQUENCY_HZ[:5], np.ones(5), mass_kg=1.0, name="short")


def test_records_that_cannot_be_compared_are_refused(rig: SimulatedRig) -> None:
    other = dataclasses.replace(rig.healthy, unit="g")
    with pytest.raises(DataError, match="m/s2 is needed"):
        identify(rig.fault, other, rig.excitation, bearing=BEARING)
    with pytest.raises(ConfigurationError, match="half the rate"):
        identify(rig.fault, rig.healthy, rig.excitation, bearing=BEARING, band_hz=(400.0, 12_000.0))
    with pytest.raises(ConfigurationError, match="--defect"):
        identify(rig.healthy, rig.healthy, rig.excitation, bearing=BEARING)
    with pytest.raises(DataError, match="Widen --band"):
        identify(rig.fault, rig.healthy, rig.excitation, bearing=BEARING, band_hz=(400.0, 1000.0))


def test_the_scatter_is_that_of_the_force_that_was_missed() -> None:
    """Over rigs; the most likely one by itself is a fifth too small: the root of 15 of 23."""
    rigs = [simulated_rig(seed, missed_db=1.5) for seed in range(5, 8)]
    paths = [identify(rig.fault, rig.healthy, rig.excitation, bearing=BEARING).path for rig in rigs]
    assert math.sqrt(np.mean([path.scatter_db**2 for path in paths])) == pytest.approx(1.5, rel=0.15)


def test_one_loud_band_is_no_mode() -> None:
    """Seen in OR 877: its fifteenth harmonic alone stands out, by the criterion a mode as narrow as bands can show."""
    plain = simulated_rig(2, path=dataclasses.replace(TRUE, modes=()))
    data = band_powers(plain.fault, plain.healthy, plain.excitation, bearing=BEARING, band_hz=BAND_HZ)
    fault = data.fault.copy()
    fault[data.size // 2] *= 10**0.9
    fits = fit_path(dataclasses.replace(data, fault=fault), 1)
    assert [fit.one_band for fit in fits] == [False, True]
    assert fits[1].criterion < fits[0].criterion
    assert best_of(fits).modes == 0
