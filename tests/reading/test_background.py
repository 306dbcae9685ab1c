"""A measured background: its power is added, it is marked, and no increment is taken of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from srbval.cli import main
from srbval.diagnosis.baseline import on_background
from srbval.errors import ConfigurationError
from srbval.reading.pipeline import one_signal
from srbval.recordings import Origin, Recording
from srbval.recordings.speed import prescribed_speed

FS_HZ, SIZE = 4096.0, 8192


def record(origin: Origin, *, seed: int, size: int = SIZE, rpm: float = 859.0) -> Recording:
    samples = np.random.default_rng(seed).standard_normal(size)
    return Recording(
        name=str(origin), origin=origin, channels={"x": samples, "y": 0 * samples}, channel="x", fs_hz=FS_HZ,
        unit="m/s2", speed=prescribed_speed(rpm / 60),
    )  # fmt: skip


RUN, HEALTHY = record(Origin.SIMULATED, seed=1), record(Origin.MEASURED, seed=2, size=SIZE + 100)


def test_what_is_added_has_the_healthy_records_spectrum() -> None:
    added = one_signal(on_background(RUN, HEALTHY)) - one_signal(RUN)
    expected = np.abs(np.fft.rfft(one_signal(HEALTHY)[:SIZE]))
    np.testing.assert_allclose(np.abs(np.fft.rfft(added)), expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("run", "healthy", "said"),
    [
        (HEALTHY, HEALTHY, "these are measured and measured"),
        (RUN, RUN, "these are simulated and simulated"),
        (RUN, replace(HEALTHY, fs_hz=5000.0), "sampled at 5000.0, the run sampled at 4096.0"),
        (RUN, replace(HEALTHY, unit="g"), "in g, the run in m/s2"),
        (RUN, record(Origin.MEASURED, seed=2, size=SIZE - 1), "must last as long as the run, 2 s"),
    ],
)
def test_what_does_not_fit_is_refused(run: Recording, healthy: Recording, said: str) -> None:
    with pytest.raises(ConfigurationError, match=said):
        on_background(run, healthy)


def test_no_increment_over_a_healthy_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither one that is asked for nor one that is registered."""
    files = {name: tmp_path / f"{name}.csv" for name in ("run", "healthy")}
    for name, file in files.items():
        np.savetxt(file, np.random.default_rng(len(name)).standard_normal(40_960), header="x [m/s2]")
    common = ["--fs", "20480", "--rpm", "859", "--bearing", "skf-22240", "--unit", "m/s2",
              "--band", "1400", "2800"]  # fmt: skip
    run, healthy = str(files["run"]), str(files["healthy"])
    assert main(["analyse", run, *common, "--background", healthy, "--healthy", healthy]) == 2
    assert "exclude each other" in capsys.readouterr().err
    assert main(["analyse", run, *common, "--background", healthy]) == 2
    assert "takes a simulated run and a measured record" in capsys.readouterr().err
    # read as a run, it is held against nothing, whatever is registered
    monkeypatch.setattr("srbval.cli.analyse_command.on_background", lambda *records: records[0])
    monkeypatch.setattr("srbval.cli.analyse_command._baseline", lambda *_: pytest.fail("a baseline was looked for"))
    assert main(["analyse", run, *common, "--background", healthy]) == 0
