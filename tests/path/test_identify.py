"""Identifying the path to the sensor: on simulated truth, its intervals, and bad input."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from srbval import ConfigurationError, DataError, load_scene
from srbval.bearing import Fault
from srbval.path import identify as module
from srbval.path.identify import Pair, identify, joined, third_octaves
from srbval.recordings.load import read_frf
from srbval.recordings.registry import load_registered
from tests.path.simulated_rig import BEARING, GAINS, RATIO, TRUE, simulated_rig

NEAR_DB = 0.2  # of gains: pulses here are far above the noise
BIAS = 0.05  # of the ratio: what slip of a few tenths of a per cent takes from the sidebands
FREQUENCY_HZ = np.linspace(350, 3600, 800)
BAND_HZ = (400.0, 3150.0)


@pytest.fixture(scope="module")
def rig():
    return simulated_rig(1)


@pytest.fixture(scope="module")
def found(rig):
    return identify(rig.outer, rig.inner, bearing=BEARING)


def test_a_known_path_is_found_in_both_directions(found):
    path = found.path
    true = np.abs(TRUE.response(np.array(path.frequency_hz)))
    off_db = 20 * np.log10(np.array(path.load) / true[0])
    assert path.frequency_hz[0] == pytest.approx(501, abs=1)  # joined with 631 Hz; 398 Hz alone is too narrow
    assert path.frequency_hz[-1] == pytest.approx(3162, abs=1)
    assert off_db[4:] == pytest.approx(0.0, abs=NEAR_DB)
    assert (path.load[0], path.load[2]) == (path.load[1], path.load[3])  # third octaves below 1259 Hz are joined
    assert np.all(np.abs(off_db[:4]) < 2 * np.array(path.u_db[:4]))
    assert min(path.u_db[:4]) > np.std(20 * np.log10(GAINS[1:])) / 2
    assert path.cross[0] / path.load[0] == pytest.approx(RATIO, rel=BIAS)
    assert abs(20 * np.log10(path.cross[0] / path.load[0] / RATIO)) < 2 * path.cross_u_db
    assert path.used == ("OR", "IR (direction)")


def test_the_run_behind_the_path_has_the_records_power_in_every_band(rig, found):
    order = module.line_order(rig.outer.run, BEARING)
    bands = joined(third_octaves(BAND_HZ), 2 * order * rig.outer.run.scene.shaft_speed_rad_s / (2 * np.pi))
    shown = module.locked_db(module.behind(rig.outer.run, found.path), BEARING, bands, order)
    assert shown == pytest.approx(found.bands.record_db.iloc[[0, 2, 4, 5, 6, 7, 8]].tolist(), abs=0.05)


def test_third_octaves_are_joined_downwards_until_they_hold_two_spacings():
    """Edges by hand: 10^2.65 = 446.7, 10^2.85 = 707.9, 10^3.05 = 1122 Hz; 261 and 414 Hz are wide enough, 92 is not."""
    bands = joined(third_octaves(BAND_HZ), 234.0)
    assert [edge for low_high in list(bands.values())[:3] for edge in low_high] == pytest.approx(
        [446.7, 707.9, 707.9, 1122.0, 1122.0, 1412.5], abs=0.1
    )
    assert list(bands)[:3] == pytest.approx([501.2, 794.3, 1258.9], abs=0.1)
    assert joined(third_octaves(BAND_HZ), 90.0) == third_octaves(BAND_HZ)
    assert joined(third_octaves(BAND_HZ), 4000.0) == {}


def test_sidebands_of_the_inner_race_alone_determine_the_ratio(rig):
    alone = identify(rig.inner, bearing=BEARING).path
    assert alone.cross[0] / alone.load[0] == pytest.approx(RATIO, rel=BIAS)
    assert alone.used == ("IR", "IR (direction)")
    outer = identify(rig.outer, bearing=BEARING)
    assert outer.path.cross == outer.path.load
    assert outer.sidebands_db is None


def test_the_power_of_a_healthy_record_at_the_passage_is_subtracted(rig, found):
    """A healthy record with half of the faulty one's amplitude has a quarter of its power: sqrt(3/4) of the gains."""
    samples = {"a": 0.5 * rig.outer.record.channels["a"]}
    healthy = dataclasses.replace(rig.outer.record, name="H", state=Fault.HEALTHY, channels=samples)
    less = identify(rig.outer, rig.inner, bearing=BEARING, healthy=healthy).path
    assert np.array(less.load) / found.path.load == pytest.approx(0.75**0.5, rel=0.01)


def test_noisy_gains_scatter_as_their_uncertainty_states():
    """Over rigs, with a background as strong as the pulses behind the path."""
    rigs = [simulated_rig(seed, noise=3.0) for seed in range(5, 15)]
    paths = [identify(rig.outer, bearing=BEARING, band_hz=(1200.0, 3200.0)).path for rig in rigs]
    off, u = [], []
    for path in paths:
        true = np.abs(TRUE.response(np.array(path.frequency_hz))[0])
        off += (20 * np.log10(np.array(path.load) / true)).tolist()
        u += path.u_db
    assert 0.6 < np.std(off) / np.sqrt(np.mean(np.square(u))) < 1.4  # 10 rigs of five bands


def test_the_bundled_path_is_what_the_rigs_two_records_give(recordings_dir):
    files = [str(recordings_dir / "torino" / f"{name}_877rpm_sample.mat") for name in ("OR", "IR")]
    pairs = [Pair(record=one, run=module.simulated_run(one, load_scene("rig"))) for one in map(load_registered, files)]
    bundled, own = load_scene("rig", {"sensor_path": "rig"}).sensor_path, identify(*pairs, bearing=BEARING).path
    assert bundled is not None
    for name in ("load", "cross", "u_db"):
        assert getattr(own, name) == pytest.approx(getattr(bundled, name), rel=0.01)


def written(path: Path, values: np.ndarray, header: str = "frequency_hz,real_m_s2_n,imag_m_s2_n") -> Path:
    rows = [f"{f!r},{v.real!r},{v.imag!r}" for f, v in zip(FREQUENCY_HZ.tolist(), values.tolist(), strict=True)]
    path.write_text("\n".join([header, *rows]), encoding="utf-8")
    return path


def test_a_measured_response_from_a_table_and_from_uff(tmp_path, srbval_json, monkeypatch):
    values = TRUE.response(FREQUENCY_HZ)[0] / 92.0
    noisy = values + np.random.default_rng(1).normal(0, 1e-5, (values.size, 2)) @ [1, 1j]
    table, across = written(tmp_path / "hammer.csv", noisy), written(tmp_path / "across.csv", 3 * noisy)
    output = str(tmp_path / "path.toml")
    command = ["identify", str(table), "--cross-from", str(across), "--mass-kg", "92", "-o", output]
    bands = srbval_json(*command)["bands"]
    assert [band["load"] for band in bands] == pytest.approx(TRUE.load, rel=0.01)
    assert [band["cross"] for band in bands] == pytest.approx([3 * band["load"] for band in bands])
    assert load_scene("rig", {"sensor_path": output}).sensor_path.load == pytest.approx(TRUE.load, rel=0.01)
    pyuff = pytest.importorskip("pyuff")
    one = dict.fromkeys(("rsp_node", "ref_node"), 1) | dict.fromkeys(("rsp_dir", "ref_dir"), 3)
    one |= {"type": 58, "func_type": 4, "x": FREQUENCY_HZ, "data": noisy, "id1": "hammer", "abscissa_spacing": 0}
    one |= {"rsp_ent_name": "sensor", "ref_ent_name": "seat", "abscissa_spec_data_type": 18}
    one |= {"ordinate_spec_data_type": 12, "orddenom_spec_data_type": 13}
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
        ("frequency_hz,real_m_s2_n,imag_m_s2_n\n1,2,x\n2,2,3", "not finite"),
    ],
)
def test_what_is_no_response_is_refused(text, said, tmp_path):
    (tmp_path / "bad.csv").write_text(text, encoding="utf-8")
    with pytest.raises(DataError, match=said):
        read_frf(tmp_path / "bad.csv")


def test_records_that_cannot_be_used_are_refused(rig):
    def changed(**changes: object) -> Pair:
        return dataclasses.replace(rig.outer, record=dataclasses.replace(rig.outer.record, **changes))

    for pair, error, said in (
        (changed(unit="g"), DataError, "m/s2 is needed"),
        (changed(state=Fault.HEALTHY), ConfigurationError, "--defect"),
        (changed(speed=None), ConfigurationError, "--rpm"),
        (changed(channels={"a": np.random.default_rng(1).standard_normal(40960)}), DataError, "Widen --band"),
    ):
        with pytest.raises(error, match=said):
            identify(pair, bearing=BEARING)
    for band_hz in ((400.0, 12_000.0), (3000.0, 400.0), (1050.0, 1100.0)):
        with pytest.raises(ConfigurationError, match="hold the middle of a third octave"):
            identify(rig.outer, bearing=BEARING, band_hz=band_hz)
    with pytest.raises(DataError, match="inner-race fault"):
        identify(rig.outer, rig.outer, bearing=BEARING)
