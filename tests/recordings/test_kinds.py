"""Files as loggers, spreadsheets, LabVIEW, MATLAB, NI, gateways and pandas write them are read, or clearly refused."""

import json

import h5py
import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import eye_array

from srbval.errors import DataError
from srbval.reading.analyse import analyse
from srbval.reading.features import features_of
from srbval.recordings import RecordingSettings, load_recording
from srbval.recordings.speed import stated_speed
from srbval.recordings.times import read_counter
from srbval.recordings.units import known_unit

from .formats import BEARING, MEANT

N, FS_HZ, G = 4096, 12_800, 9.80665
X = np.round(np.random.default_rng(3).normal(size=N), 5)
T = np.arange(N) / FS_HZ
LVM = f"""LabVIEW Measurement
Separator\tTab
Decimal_Separator\t.
Multi_Headings\tNo
X_Columns\tOne
***End_of_Header***\t

Channels\t1\t
Samples\t{N}\t
Y_Unit_Label\tg\t
X_Dimension\tTime\t
X0\t0.0E+0\t
Delta_X\t{1 / FS_HZ:.8E}\t
***End_of_Header***\t\t
X_Value\tDE\tComment"""


def rows(form, *, comma=False):
    """A line for each sample i with its number, time, value, or the text OVLD (1.0 in every ninth line)."""
    lines = []
    for i, (t, x) in enumerate(zip(T, X, strict=True)):
        more = {"ms": 1e3 * t, "ns": int(t * 1e9), "days": 45418.5 + t / 86400, "n": "OVLD" if i % 9 else 1.0}
        lines.append(form.format(i=i, t=t, x=x, **more))
    return [line.replace(".", ",") for line in lines] if comma else lines


BLOCKS = [
    {"ts": 1714996800 + k / FS_HZ, "fs": FS_HZ, "unit": "g", "z": X[k : k + 512].tolist()} for k in range(0, N, 512)
]
TEXTS = {
    "spreadsheet days": ["Date/Time;acc [g]", *rows("{days:.12f};{x}")],
    "minutes": [
        "Time,acc (g)",
        *(f"{59 * (t < 0.1):02d}:{(59.9 + t) % 60:09.6f},{x}" for t, x in zip(T, X, strict=True)),
    ],
    "pandas index": [",acc_g", *rows("2024-05-06 12:00:00.{ns:09d},{x}")],
    "quoted commas": ['"Time [s]","acc [g]"', *(row.replace(";", '","') for row in rows('"{t:.7f};{x}"', comma=True))],
    "step above": ["TraceName: pump", "SampleTime: 0.078125 ms", "Unit: g", "", *rows("{x}")],
    "remarks below": ["t,acc_g", *rows("{t:.7f},{x}"), "", "End of data", "Mean;0.02"],
    "overload in another column": ["t [s],acc [g],aux", *rows("{t:.7f},{x},{n}")],
    "long row": ["Sample rate: 12800", "Unit: g", "", "DE;" + ";".join(map(str, X)).replace(".", ",")],
    "LabVIEW": [LVM, *rows("{t:.8f}\t{x}")],
    "JSON blocks": [json.dumps(block) for block in BLOCKS],
    "JSON records": [json.dumps([{"t": t, "acc": x} for t, x in zip(T.tolist(), X.tolist(), strict=True)])],
    "JSON document": [json.dumps({"sampleRate": FS_HZ, "units": "g", "values": {"x": X.tolist()}})],
}


@pytest.mark.parametrize("kind", TEXTS)
def test_texts(tmp_path, kind):
    (tmp_path / "a.txt").write_text("\n".join(TEXTS[kind]) + "\n", newline="")
    found = load_recording(tmp_path / "a.txt", unit="g" if kind == "JSON records" else None)
    assert (found.fs_hz, found.unit) == (pytest.approx(FS_HZ, rel=1e-5), "m/s2")
    np.testing.assert_allclose(found.channels[found.channel], G * X, atol=1e-12)
    assert found.cautions == ()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n", "a Git LFS pointer.*git lfs pull"),
        ("../.git/annex/objects/Xk/9z/SHA256E-s12--ab.csv", "a git-annex pointer"),
        ("\n<HTML><head><title>Sign in</title></head></HTML>\n", "an HTML page"),
        ("<?xml version='1.0'?>\n<Workbook>\n</Workbook>\n", "an XML document"),
        ('{"a": 1}\n{"a":\n', "a JSON text that cannot be read"),
        ("\n".join(["t [s],env [gE]", *rows("{t:.7f},{x}")]), "an acceleration envelope"),
        ("\n".join(["t [s],acc [g]", *rows("{t:.7f},{x}")[:999], "9.0,Err"]), "not finite.*'Err'.*line 1001"),
    ],
)
def test_what_a_file_is_instead(tmp_path, text, said):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(DataError, match=said):
        load_recording(tmp_path / "a.csv")


@pytest.mark.parametrize("counter", [lambda i: i, lambda i: 5000 + i, lambda i: i % 256, lambda i: i % 65536])
def test_counters_that_begin_again(counter):
    there = np.setdiff1d(np.arange(100_000), [*range(1000, 1009), 2000, 3000])
    np.testing.assert_array_equal(read_counter(counter(there)), there)


@pytest.mark.parametrize(("written", "unit"), MEANT.items())
def test_spellings_of_units(written, unit):
    assert known_unit(written) == unit


@pytest.mark.parametrize(("unit", "factor"), [("mm/s", 1.0), ("ips", 25.4), ("m/s", 1e3), ("um", None), ("mil", None)])
def test_velocities_and_displacements_stay_what_they_are(tmp_path, unit, factor):
    """A sine of 50 Hz has the right RMS in its own unit, and the right velocity of ISO 20816."""
    at = np.arange(4 * N) / FS_HZ
    table = np.stack([at, np.sin(2 * np.pi * 50 * at)], 1)
    np.savetxt(tmp_path / "a.csv", table, header=f"t [s],x [{unit}]", delimiter=",", comments="")
    found = load_recording(tmp_path / "a.csv")
    features = features_of(analyse(found, bearing=BEARING, speed=stated_speed(6000, 1.0), band_hz=(2000.0, 4000.0)))
    rms = {"um": 1.0, "mil": 25.4}.get(unit, factor or 0.0) * np.sqrt(0.5)
    assert features["unit"] == ("um" if factor is None else "mm/s")
    assert features["rms"] == pytest.approx(rms, rel=1e-3)
    assert features["velocity_rms_mm_s"] == pytest.approx(rms if factor else rms * 2 * np.pi * 50e-3, rel=2e-2)


def test_a_unit_is_never_overridden_silently(tmp_path):
    (tmp_path / "a.csv").write_text("\n".join(["t [s],v [mm/s]", *rows("{t:.7f},{x}")]))
    with pytest.raises(DataError, match=r"the file states mm/s for v \[mm/s\], --unit g contradicts it"):
        load_recording(tmp_path / "a.csv", unit="g")
    said = "the file states mm/s for v [mm/s], --unit ips is used"
    assert said in load_recording(tmp_path / "a.csv", unit="in/s").cautions
    scaled = load_recording(tmp_path / "a.csv", RecordingSettings(unit="g", scale=0.1))
    np.testing.assert_allclose(scaled.channels["v [mm/s]"], 0.1 * G * X)


@pytest.mark.parametrize("name", ["adc", "ch1", "raw counts"])
@pytest.mark.parametrize("unit", ["g", "mm/s", "V"])
def test_counts_have_no_level(tmp_path, name, unit):
    (tmp_path / "a.csv").write_text("\n".join([name, *(f"{2048 + 100 * x:.0f}" for x in X)]))
    found = load_recording(tmp_path / "a.csv", fs_hz=float(FS_HZ), unit=unit)
    assert (found.unit, found.scale_missing) == ("unknown", True)
    assert "whole numbers of a converter" in found.cautions[0]
    assert not load_recording(tmp_path / "a.csv", fs_hz=float(FS_HZ), unit="mg").scale_missing or name != "ch1"


@pytest.mark.parametrize(
    ("header", "row", "example"),
    [
        ("t_ms,n,level,acc,temp [C]", "{ms:.5f},{i},5,{x},4{t:.2f}", "--unit g"),
        ("Time;speed;velocity", "12:00:0{t:.6f};1797;{x}", "--unit mm/s"),
        ("t [s],a [furlong/s2]", "{t:.7f},{x}", "--unit unknown"),
        ("t,acc [g],acc2 [g]", "{i}00.0,{x},{x}1", "--channel 'acc [g]' --fs 10000"),
    ],
)
def test_an_example_holds_only_what_fits(tmp_path, header, row, example):
    (tmp_path / "a.csv").write_text("\n".join([header, *rows(row)]))
    with pytest.raises(DataError) as asked:
        load_recording(tmp_path / "a.csv")
    examples = (q.example for q in asked.value.questions if not q.missing.startswith(("no bearing", "no shaft speed")))
    assert " ".join(examples) == example


KIND = [(name, "O") for name in ("Name", "Unit", "Raster", "Data")]


def struct_array(path):
    signals = [("force", "kN", "Mech_4kHz", X[:1280]), ("vibration_1", "g", "HostService", X)]
    times = [("Time", "s", "HostService", T)]
    savemat(path, {"N15": {"Y": np.array(signals, dtype=KIND), "X": np.array(times, dtype=KIND)}})


def rasters(path):
    signals = [("a", "g", 1 / FS_HZ, X), ("n", "rpm", 1 / 400, np.full(400, 1797.0))]
    savemat(path, {"Y": np.array(signals, dtype=KIND)})


def upper_case(path):
    text = {"label": "grün", "complex": np.ones(3) * 1j, "sparse": eye_array(5).tocsc(), "empty": np.zeros((0, 3))}
    savemat(path, {"Signal": X, "Fs": float(FS_HZ), "Units": "g", **text})


def hdf5(path):
    with h5py.File(path, "w") as file:
        group = file.create_group("run")
        group["acc"], group["time"] = X, 1e3 * T
        group["time"].attrs["units"] = "ms"
        group["acc"].attrs["UNITS"], group.attrs["SampleRate"], group.attrs["empty"] = "g", FS_HZ, h5py.Empty("S1")


def index(path):
    pd, parquet, pa = (pytest.importorskip(name) for name in ("pandas", "pyarrow.parquet", "pyarrow"))
    at = pd.to_timedelta(T, unit="s") + pd.Timestamp("2024-05-06")
    parquet.write_table(pa.Table.from_pandas(pd.DataFrame({"acc [g]": X, "rpm": np.full(N, np.nan)}, index=at)), path)


def tdms(path, cut=0):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        facts = {"NI_CM_Dt": f"{1 / FS_HZ:.10E}", "NI_CM_Speed": "505", "unit_string": "g"}
        writer.write_segment([nptdms.ChannelObject("Waveform", "DE", X, properties=facts)])
    whole = bytearray(path.read_bytes())
    whole[12:20] = b"\xff" * 8  # the segment was never closed
    path.write_bytes(whole[: len(whole) - cut])


def uff(path):
    """Write a binary data set with the mark of an end among its samples and directly after them."""
    names = "\n".join(["DE".ljust(80), *["NONE".ljust(80)] * 4])
    axis = "    0    0    0 NONE                 "
    head = f"""    -1
    58b     1     2          11      {8 * N:6d}     0     0           0           0
{names}
    1         0    0         0         DE         1   3       NONE         0   0
         4{N:10d}         1  0.00000e+00{1 / FS_HZ:13.5e}  0.00000e+00
        17{axis}s
        12{axis}g
         0{axis}NONE
         0{axis}NONE
"""
    samples = bytearray(X.astype("<f8").tobytes())
    samples[800:808] = b"\n    -1\n"
    path.write_bytes(head.encode() + samples + b"    -1\n")


def wav(path):
    pytest.importorskip("soundfile").write(path, X / 8, FS_HZ, subtype="FLOAT", format="WAV")
    path.write_bytes(path.read_bytes() + b"LIST\x1a\0\0\0INFO")


@pytest.mark.parametrize("write", [struct_array, rasters, upper_case, hdf5, index, tdms, uff, wav])
def test_containers(tmp_path, write):
    write(tmp_path / "a.dat")
    found = load_recording(tmp_path / "a.dat", unit="g" if write is wav else None)
    assert (found.fs_hz, found.unit) == (pytest.approx(FS_HZ, rel=1e-5), "m/s2")
    samples = found.channels[found.channel] * (8 if write is wav else 1)
    assert (np.abs(samples - G * X) > 1e-5).sum() == (write is uff)
    assert bool(found.cautions) == (write in (tdms, wav))
    assert found.speed is None or found.speed.value_hz * 60 == pytest.approx(505)


def test_the_whole_part_of_a_segment_that_is_cut(tmp_path):
    tdms(tmp_path / "a.tdms", cut=800)
    found = load_recording(tmp_path / "a.tdms")
    np.testing.assert_allclose(found.channels["DE"], G * X[:-100])
    assert "cut" in found.cautions[0] or "not closed" in found.cautions[0]
