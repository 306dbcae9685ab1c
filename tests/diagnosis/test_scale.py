"""Whole numbers of a converter: each file has its own scale, and without one no level is compared."""

import json
from pathlib import Path

import numpy as np
import pytest

from srbval.cli import main
from srbval.errors import DataError
from srbval.recordings import RecordingSettings
from srbval.recordings.registry import add, load_registered
from srbval.report.reports import report_recordings
from tests.recordings.formats import FS_HZ, SHAFT_HZ, record

HALF = 2**15 - 1
DIGITS = 0.01  # of a ratio: 16 bits of each record's own range, in a band with a part of its power
GIVEN = ["--bearing", "skf-6205", "--band", "1400", "2800", "--rpm", str(60 * SHAFT_HZ), "--fs", str(FS_HZ)]


def written(path: Path, samples: np.ndarray, kind: str) -> tuple[str, float]:
    """The file in which the largest sample is 0.9 of full scale, and its scale [g]."""
    full = float(np.abs(samples).max()) / 0.9
    if kind == "wav":
        pytest.importorskip("soundfile").write(path, samples / full, round(FS_HZ), subtype="PCM_16", format="WAV")
        return str(path), full
    with path.open("wb") as file:
        np.save(file, np.round(samples / full * HALF).astype("i2") if kind == "counts" else samples)
    return str(path), full / HALF if kind == "counts" else 1.0


@pytest.mark.parametrize("kind", ["wav", "counts"])
def test_levels_of_files_of_unlike_full_scale(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The healthy record is a hundredth as strong, and fills its file as the faulty one does."""

    def ratio(healthy: str, *options: str) -> float:
        assert main(["analyse", faulty, "--healthy", healthy, *GIVEN, *options, "--json"]) == 0
        return json.loads(capsys.readouterr().out)["fault"]["ratio"]

    quiet, loud = record()[0] / 100, record()[1]
    faulty, _ = written(tmp_path / "f.npy", loud, "numbers")
    true = ratio(written(tmp_path / "h.npy", quiet, "numbers")[0], "--unit", "g")
    (faulty, scale), (healthy, quiet_scale) = written(tmp_path / "f", loud, kind), written(tmp_path / "h", quiet, kind)
    stated = ["--unit", "g", "--scale", str(scale)]
    assert ratio(healthy, *stated, "--healthy-scale", str(quiet_scale)) == pytest.approx(true, rel=DIGITS)
    for wrong, code, said in (
        (stated, 2, "--healthy-scale F"),
        (["--unit", "g"], 3, "without a scale: levels cannot be compared"),
    ):
        assert main(["analyse", faulty, "--healthy", healthy, *GIVEN, *wrong]) == code
        assert said in capsys.readouterr().err
    assert ratio(healthy, "--unit", "unknown") < true / 1000  # shares of the mean do not depend on the gain
    settings = RecordingSettings(unit="g", fs_hz=FS_HZ, rpm=60 * SHAFT_HZ)
    alone = load_registered(faulty, settings)
    assert (alone.unit, alone.scale_missing) == ("unknown", True)
    with pytest.raises(DataError, match="cannot be compared"):
        report_recordings([alone], tmp_path / "r", bearing="skf-6205", healthy=load_registered(healthy, settings))
    add(healthy, settings=RecordingSettings(unit="mg", scale=1e3 * quiet_scale))
    assert ratio(healthy, *stated) == pytest.approx(true, rel=DIGITS)
