"""The package's public names, loaded only when used; pictures, tables and short representations for notebooks."""

import ast
import dataclasses
import functools
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray
from matplotlib.figure import Figure

import srbval
from srbval.recordings.registry import recording_of
from tests.reading.test_shaft_speed import BEARING, record


def test_every_name_is_there():
    assert [name for name in srbval.__all__ if getattr(srbval, name) is None] == []


def test_what_is_loaded_is_what_type_checkers_see():
    stub = ast.parse(Path(srbval.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    (seen,) = (ast.literal_eval(node.value) for node in stub.body if isinstance(node, ast.Assign))
    assert sorted(srbval.__all__) == sorted(seen)


@functools.cache
def run() -> srbval.Run:
    return srbval.simulate(srbval.paper_scene(model="impulse", duration="1 s", defect={"kind": "outer"}))


@functools.cache
def analysis() -> srbval.Analysis:
    return srbval.analyse(record(shaft_hz=25.0), bearing=BEARING)


def test_a_run_is_a_table_and_a_line_of_text():
    frame = run().to_frame()
    assert len(frame) == run().samples
    assert frame["acceleration_x_m_s2"].to_numpy() == pytest.approx(run().acceleration_m_s2[:, 0])
    assert repr(run()).startswith("<Run ok: impulse model, skf-22240, outer race, 710 rpm, 1 s")


def test_an_analysis_is_a_table_a_picture_and_a_line_of_text():
    frame = analysis().to_frame()
    assert [*frame["found_hz"].dropna()] == [line.found_hz for line in analysis().lines if line.detected] != []
    labels = [text.get_text() for text in analysis().plot(new_axes()).texts]
    assert any(text.startswith("BPFI  135.4 Hz") for text in labels)
    assert repr(analysis()).endswith("BPFI detected>")
    assert repr(analysis().recording) == "<Recording made for the test: measured, inner race, x, 3 s at 12000 Hz>"


def new_axes():
    return Figure().add_subplot()


SHOWN = {
    "recording": lambda: analysis().recording,
    "analysis": analysis,
    "diagnosis": lambda: srbval.diagnose(analysis()),
    "run": run,
    "spectrum": lambda: analysis().processed.spectrum,
    "bearing": lambda: srbval.load_bearing("skf-22240"),
    "validation": lambda: srbval.validate(simulated=analysis().recording, measured=analysis().recording),
}


@pytest.mark.parametrize("kind", SHOWN)
def test_objects_draw_onto_given_axes_and_show_a_table(kind):
    shown, axes = SHOWN[kind](), new_axes()
    assert shown.plot(axes) is axes
    assert axes.lines or axes.patches
    page = shown._repr_html_()
    assert page.count("<tr") > 1
    assert "<script" not in page


FAULTY, HEALTHY = "OR_877rpm_sample.h5", "H_877rpm_sample.h5"
USES = {
    "load_recording": lambda record: repr(srbval.load_recording(record)),
    "plot": lambda record: srbval.plot(record, new_axes()).get_title("left"),
    "healthy": lambda record: srbval.analyse(FAULTY, healthy=record, auto_band=True).band.why,
    "baseline_of": lambda record: srbval.baseline_of(srbval.analyse(FAULTY), record).analysis.recording.name,
    "features": lambda record: srbval.features(record).loc[0, "name"],
}


@pytest.mark.parametrize("use", USES)
def test_a_record_may_be_a_name_a_path_a_recording_or_a_run(use):
    record = srbval.load_recording(HEALTHY)
    assert len({USES[use](one) for one in (HEALTHY, Path(record.file), record)}) == 1
    assert USES[use](run())


@pytest.mark.parametrize("measured", ["OR_877rpm_sample.h5", "simulated", "own"])
def test_round_trips_through_xarray_are_exact(measured, tmp_path):
    """From the object, and from a file that xarray wrote: signals to the last bit, and everything that is known."""
    recording = recording_of({"simulated": run, "own": lambda: analysis().recording}.get(measured, lambda: measured)())
    data, own_file = recording.to_xarray(), {"file": recording.file, "sha256": recording.sha256}
    data.to_netcdf(tmp_path / "record.nc", engine="h5netcdf")
    with xarray.open_dataset(tmp_path / "record.nc", engine="h5netcdf") as stored:
        assert stored.identical(data)
        again = [srbval.Recording.from_xarray(one) for one in (data, stored)]
    for one in (*again, dataclasses.replace(srbval.load_recording(tmp_path / "record.nc"), **own_file)):
        for name, samples in recording.channels.items():
            assert np.array_equal(one.channels[name], samples)
        assert one.facts() == recording.facts()
        if recording.speed_signal is not None:
            assert np.array_equal(one.speed_signal.values_hz, recording.speed_signal.values_hz)
    with pytest.raises(srbval.DataError, match="by the attribute fs_hz"):
        srbval.Recording.from_xarray(data.isel(time_s=slice(None, None, 2)))


def test_a_run_file_is_what_to_xarray_gives(tmp_path):
    srbval.write_run(run(), tmp_path / "run.h5")
    with xarray.open_dataset(tmp_path / "run.h5", engine="h5netcdf") as stored:
        assert stored.equals(run().to_xarray())
        assert stored["acceleration_x_m_s2"].dims == ("time_s",)
        assert stored["time_s"].to_numpy() == pytest.approx((1 + np.arange(run().samples)) / 20480, rel=1e-12)
        read = srbval.Recording.from_xarray(stored)
    assert np.array_equal(read.channels["y"], run().acceleration_m_s2[:, 1])
    assert read.own_bearing == srbval.load_recording(tmp_path / "run.h5").own_bearing
    spectrum = analysis().processed.spectrum
    assert np.array_equal(spectrum.to_xarray().sel(frequency_hz=spectrum.frequency_hz[5]), spectrum.amplitude[5])


SESSION = """
import numpy as np, pandas as pd, xarray as xr
import srbval
run = srbval.simulate(srbval.paper_scene(defect="outer", duration="2 s", model="impulse"))
srbval.simulate("outer.toml").plot()
run.to_xarray().acceleration_y_m_s2.std()
srbval.analyse(run).to_frame().query("detected")
analysis = srbval.analyse("OR_877rpm_sample.h5")
analysis.plot().set_title("mine")
diagnosis = srbval.diagnose(analysis)
diagnosis.probabilities["outer"] > 0.5
x = np.random.default_rng(0).standard_normal(40_000)
mine = srbval.Recording.from_array(x, fs_hz=20_000, unit="g", rpm=1500, bearing="skf-6205")
table = srbval.Recording.from_frame(pd.DataFrame({"time": np.arange(40_000) / 20_000, "acc [g]": x}))
other = srbval.Recording.from_xarray(xr.DataArray(x, dims="time", coords={"time": table.time_s}, attrs={"units": "g"}))
np.array_equal(other.channels["signal"], table.channels["acc [g]"])
srbval.analyse(other, rpm=1500, bearing="skf-6205", auto_band=True)
srbval.trend(*[mine] * 6, baseline=5).to_frame()
srbval.plan("paper", question="slip").to_frame()
stated = {"uncertainty.cage_pct": 0.01, "uncertainty.level_db": 1.0}
validation = srbval.validate(changes=stated, simulated=run, measured="OR_877rpm_sample.h5", state="outer")
srbval.report(analysis.recording, mine, bearing="skf-22240", folder="report")["html"].stat().st_size > 1000
done = srbval.run_campaign(Path("speeds.toml"), "speeds", engine="local")
srbval.trend("speeds").time_from == "the campaign's cases" and len(srbval.features("speeds")) == 2
srbval.load_campaign("speeds").to_xarray(signals=True).acceleration_y_m_s2.std("time_s")
"""
WRONG = {
    r"give it with rpm=\.\.\.": "srbval.analyse(table, bearing='skf-6205')",
    r'engine="dask" or engine=\.\.\.': "srbval.choose_engine(adapt=True)",
    'use model="full"': "srbval.simulate(srbval.paper_scene(model='line', defect='roller'))",
    "none.csv: no such file": "srbval.trend('speeds', times='none.csv')",
    "'none' is not known": "srbval.validate(changes={'bearing': 'none'}, simulated=run, measured=mine, state='outer')",
}


def test_a_session_in_a_notebook(tmp_path, monkeypatch):
    """Run a session of a user who guesses every name, in an empty folder; every line is a value or shows one."""
    monkeypatch.chdir(tmp_path)
    speeds = 'name = "speeds"\noutputs = ["acceleration"]\n'
    speeds += 'scene = { model = "planar", duration = "0.7 s", settle = "0 s" }\n'
    axes = '[[axes]]\nkind = "grid"\nvalues = { shaft_speed = ["400 rpm", "700 rpm"] }\n'
    (tmp_path / "speeds.toml").write_text(speeds + axes)
    (tmp_path / "outer.toml").write_text('model = "impulse"\nduration = "1 s"\n[defect]\nkind = "outer"\n')
    names = {"Path": Path}
    exec(SESSION, names)
    plt.close("all")
    assert not names["validation"].headline.startswith("No verdict")
    for said, wrong in WRONG.items():
        with pytest.raises(srbval.SrbvalError, match=said):
            eval(wrong, names)
