"""Data sets: segments, labels, added noise, the card; the commands."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from srbval.campaign.export import export_campaign
from srbval.cli import main
from srbval.errors import ConfigurationError, DataError
from tests.campaign.campaigns import FAILING, run_small, small

AXES = [
    {"kind": "list", "cases": [{"defect.kind": "none"}, {"defect.kind": "roller", "shaft_speed": "500 rpm"}, FAILING]}
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("campaign")
    run_small(small(axes=AXES), made)
    return made


def test_segments_and_labels(folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "set.h5"
    made = export_campaign(folder, file, segment_s=2e-3, snr_db=(10.0, -3.0))
    assert (made["segments"], made["samples"], made["left_out"]) == (2 * 2 * 3, 41, 1)
    with h5py.File(file) as found:
        table = {name: found[name][()] for name in found}
        card = str(found.attrs["data_card"])
    assert table["state"].tolist() == [0] * 6 + [3] * 6
    assert table["case"].tolist() == [0] * 6 + [1] * 6
    assert table["snr_db"].tolist() == [np.inf, 10, -3] * 4
    assert table["start_s"][:6] == pytest.approx([0, 0, 0, 41 / 20480, 41 / 20480, 41 / 20480])
    assert table["shaft_speed_hz"][-1] == pytest.approx(500 / 60)
    assert (table["defect_height_m"][0], table["defect_extent_m"][-1]) == (0, 2e-3)
    assert "Every sample is simulated" in card
    assert "10, -3 dB" in card
    assert "split by `case`" in card


def test_the_same_settings_give_the_same_samples(folder: Path, tmp_path: Path) -> None:
    def noisy(name: str, **options: object) -> np.ndarray:
        export_campaign(folder, tmp_path / name, segment_s=2e-3, **options)  # type: ignore[arg-type]
        with h5py.File(tmp_path / name) as found:
            return np.asarray(found["segments"][found["snr_db"][()] == 0.0])

    first = noisy("a.h5", snr_db=(0.0,))
    assert np.array_equal(first, noisy("b.h5", snr_db=(5.0, 0.0)))
    assert not np.array_equal(first, noisy("c.h5", snr_db=(0.0,), seed=1))


def test_noise_of_a_recording(folder: Path, tmp_path: Path) -> None:
    noise = str(_case_with_signals(folder))
    assert export_campaign(folder, tmp_path / "set.h5", segment_s=2e-3, snr_db=(0.0,), noise=noise)["segments"] == 8
    with h5py.File(tmp_path / "set.h5") as found:
        card = str(found.attrs["data_card"])
    assert "Added noise: Gaussian, with the spectrum of " in card
    assert ", at 0 dB, seed 0." in card


def _case_with_signals(folder: Path) -> Path:
    for file in (folder / "cases").glob("*.h5"):
        with h5py.File(file) as found:
            if "acceleration_y_m_s2" in found:
                return file
    raise AssertionError("no case with signals")


def test_what_cannot_be_exported(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no case holds 1 s of signal"):
        export_campaign(folder, tmp_path / "set.h5")
    assert not (tmp_path / "set.h5").exists()
    with pytest.raises(DataError, match="no campaign here"):
        export_campaign(tmp_path, tmp_path / "set.h5")
    with pytest.raises(ConfigurationError, match="no ratio"):
        export_campaign(folder, tmp_path / "set.h5", noise="recording.mat")


def test_commands(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    def ask(*arguments: str) -> tuple[int, dict[str, object]]:
        code = main(["campaign", *arguments, "--json"])
        return code, json.loads(capsys.readouterr().out)

    file = tmp_path / "two.toml"
    file.write_text(
        'name = "two"\noutputs = ["acceleration"]\n[scene]\nduration = "5 ms"\nsettle = "0 s"\nmodel = "planar"\n'
        '[[axes]]\nkind = "grid"\nvalues = { "load.radial" = ["1 kN", "-1 kN"] }\n'
    )
    out = str(tmp_path / "run")
    code, found = ask("run", str(file), "-o", out, "--dry-run")
    assert (code, found["cases"], found["refused"], found["models"]) == (0, 2, 1, {"planar": 1})
    assert not Path(out).exists()
    code, found = ask("run", str(file), "-o", out, "--jobs", "1")
    assert (code, found["cases"], found["done"], found["engine"]) == (1, 2, 2, "local")
    assert [f["status"] for f in found["failed"]] == ["refused"]  # type: ignore[attr-defined]
    code, found = ask("status", out)
    assert (code, found["done"], found["running"]) == (0, 2, False)
    code, found = ask("export", out, "-o", str(tmp_path / "set.h5"), "--segment-seconds", "0.001")
    assert (code, found["segments"], found["left_out"]) == (0, 5, 1)
    assert ask("run", str(tmp_path / "none.toml"))[0] == 3
    assert ask("run", str(file), "-o", out, "--engine", "x")[0] == 2
