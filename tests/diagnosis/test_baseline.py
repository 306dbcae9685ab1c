"""The healthy record of the same point, what differs, and which lines have risen against it.

A measured background under a run: its power is added, it is marked, and no increment is taken of it.
"""

import dataclasses
import functools

import numpy as np
import pytest

from srbval import ConfigurationError, Origin, Recording, analyse
from srbval.bearing import Fault
from srbval.diagnosis.baseline import baseline_of, compare_with_baseline, on_background
from srbval.reading.pipeline import one_signal
from srbval.recordings.speed import nominal_speed, prescribed_speed
from tests.reading.test_shaft_speed import BEARING, record


def healthy(**changes):
    plain = record(shaft_hz=25.0, fault=False, seed=9)
    return dataclasses.replace(plain, state=Fault.HEALTHY, name="healthy one", **changes)


@functools.cache
def faulted_analysis():
    return analyse(record(shaft_hz=25.0), bearing=BEARING)


@functools.cache
def healthy_analysis():
    return analyse(healthy(), bearing=BEARING)


def test_fault_stands_above_the_healthy_record():
    call = compare_with_baseline(faulted_analysis(), healthy_analysis())
    assert (call.risen, call.line) == (Fault.INNER, "BPFI")
    assert 2 < call.ratio_ci95[0] < call.ratio < call.ratio_ci95[1]


def test_what_differs_is_named():
    ours = analyse(dataclasses.replace(record(shaft_hz=25.0), radial_n=1000.0), bearing=BEARING)
    other = healthy(radial_n=500.0, unit="unknown", speed=nominal_speed(1200.0, 0.5))
    found = baseline_of(ours, other)
    assert found.conditions == ("1200 rpm instead of 1500 rpm", "radial load 0.5 kN instead of 1 kN")
    assert found.remarks == ("not both in m/s2: lines are compared as shares of the mean, not as levels",)


def test_the_record_itself_in_another_file_is_no_baseline():
    samples = record(shaft_hz=25.0).channels["x"]
    copy = dataclasses.replace(
        record(shaft_hz=25.0), sha256="b", channels={"x": samples.astype(np.float32).astype(np.float64)}
    )
    with pytest.raises(ConfigurationError, match="the healthy record is the record itself"):
        baseline_of(faulted_analysis(), copy)


FS_HZ, SIZE = 4096.0, 8192


def background_record(origin: Origin, *, seed: int, size: int = SIZE, rpm: float = 859.0) -> Recording:
    samples = np.random.default_rng(seed).standard_normal(size)
    return Recording(
        name=str(origin),
        origin=origin,
        channels={"x": samples, "y": 0 * samples},
        channel="x",
        fs_hz=FS_HZ,
        unit="m/s2",
        speed=prescribed_speed(rpm / 60),
    )


RUN, HEALTHY = background_record(Origin.SIMULATED, seed=1), background_record(Origin.MEASURED, seed=2, size=SIZE + 100)


def test_what_is_added_has_the_healthy_records_spectrum():
    added = one_signal(on_background(RUN, HEALTHY)) - one_signal(RUN)
    expected = np.abs(np.fft.rfft(one_signal(HEALTHY)[:SIZE]))
    np.testing.assert_allclose(np.abs(np.fft.rfft(added)), expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("run", "healthy", "said"),
    [
        (HEALTHY, HEALTHY, "these are measured and measured"),
        (RUN, RUN, "these are simulated and simulated"),
        (RUN, dataclasses.replace(HEALTHY, fs_hz=5000.0), "sampled at 5000.0, the run sampled at 4096.0"),
        (RUN, dataclasses.replace(HEALTHY, unit="g"), "in g, the run in m/s2"),
        (RUN, background_record(Origin.MEASURED, seed=2, size=SIZE - 1), "must last as long as the run, 2 s"),
    ],
)
def test_what_does_not_fit_is_refused(run, healthy, said):
    with pytest.raises(ConfigurationError, match=said):
        on_background(run, healthy)


def test_no_increment_over_a_healthy_record(tmp_path, monkeypatch, srbval_text):
    """Neither one that is asked for nor one that is registered."""
    files = {name: tmp_path / f"{name}.csv" for name in ("run", "healthy")}
    for name, file in files.items():
        np.savetxt(file, np.random.default_rng(len(name)).standard_normal(40_960), header="x [m/s2]")
    common = ["--fs", "20480", "--rpm", "859", "--bearing", "skf-22240", "--unit", "m/s2", "--band", "1400", "2800"]
    run, healthy = files["run"], files["healthy"]
    command = ["analyse", run, *common, "--background", healthy]
    assert "exclude each other" in srbval_text(*command, "--healthy", healthy, code=2).err
    assert "takes a simulated run and a measured record" in srbval_text(*command, code=2).err
    # read as a run, it is held against nothing, whatever is registered
    monkeypatch.setattr("srbval.diagnosis.records.on_background", lambda *records: records[0])
    monkeypatch.delattr("srbval.diagnosis.records.registered_baseline")  # without it a search raises
    srbval_text(*command)
