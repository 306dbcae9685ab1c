"""One synthetic record in each format: the same channel, unit, rate and lines everywhere."""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from srbval.bearing import Fault, load_bearing
from srbval.errors import DataError
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings import Recording, RecordingSettings, load_recording
from srbval.recordings.loaders import detect_format, limited
from srbval.recordings.registry import FileStatus, add
from srbval.recordings.synthetic_record import vibration

FS_HZ, SHAFT_HZ, SECONDS = 20480.0, 25.0, 1.0
COUNT = round(FS_HZ * SECONDS)
BEARING = load_bearing("skf-6205")
G = 9.80665
DIGITS = 2e-6  # relative, of the largest sample: seven digits, or 24 bits
LINE_DIGITS = 1e-5  # relative, of a line: six digits of a time step, and those of the samples
MV_PER_G = 100.0
FULL_SCALE_V = 1.0


@functools.cache
def record() -> tuple[np.ndarray, np.ndarray]:
    """Two channels [g]: a sensor without and one with an outer-race fault."""
    turns = np.arange(COUNT) * SHAFT_HZ / FS_HZ
    other, sensor = (
        vibration(state, BEARING.orders, turns, np.random.default_rng(i)) / G
        for i, state in enumerate((Fault.HEALTHY, Fault.OUTER))
    )
    return other, sensor


def write_csv(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    rows = zip(np.arange(COUNT) / FS_HZ, other, sensor, strict=True)
    lines = [
        "\ufeff// exported",
        "Zeit (s);acc NDE [g];acc DE [g]",
        *(f"{t:.9f};{a:.8f};{b:.8f}".replace(".", ",") for t, a, b in rows),
    ]
    path.write_text("\r\n".join(lines) + "\r\n", encoding="utf-8")


def write_tab(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    """Names and units in lines of their own, m/s² in a signal's column."""
    rows = zip(np.arange(COUNT) / FS_HZ * 1e3, other, sensor * G, strict=True)
    lines = ["% exported", "time\tacc NDE\tacc DE", "ms\tg\tm/s²", *(f"{t:.7f}\t{a:.8f}\t{b:.8f}" for t, a, b in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="latin-1")


def write_wav(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    soundfile = pytest.importorskip("soundfile")
    soundfile.write(path, np.stack([other, sensor], axis=1), round(FS_HZ), subtype="FLOAT", format="WAV")


def write_flac(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    """24 bits of a converter of +-5 V behind a sensor of 100 mV/g."""
    soundfile = pytest.importorskip("soundfile")
    volts = np.stack([other, sensor], axis=1) * MV_PER_G / 1e3
    soundfile.write(path, volts / FULL_SCALE_V, round(FS_HZ), subtype="PCM_24", format="FLAC")


def write_tdms(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    nptdms = pytest.importorskip("nptdms")
    properties = {"wf_increment": 1 / FS_HZ, "unit_string": "g"}
    with nptdms.TdmsWriter(path) as writer:
        for name, samples in (("acc NDE", other), ("acc DE", sensor)):
            writer.write_segment([nptdms.ChannelObject("vibration", name, samples, properties=properties)])


def write_uff(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    pyuff = pytest.importorskip("pyuff")
    sets = [
        pyuff.prepare_58(
            binary=0, func_type=1, rsp_node=node, rsp_dir=3, ref_node=1, ref_dir=0, data=samples, id1=name,
            x=np.arange(COUNT) / FS_HZ, num_pts=COUNT, abscissa_spec_data_type=17, ordinate_spec_data_type=12,
            ordinate_axis_units_lab="g", orddenom_spec_data_type=0, z_axis_spec_data_type=0, abscissa_spacing=1,
        )
        for node, (name, samples) in enumerate((("acc NDE", other), ("acc DE", sensor)), 1)
    ]  # fmt: skip
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")


def table(other: np.ndarray, sensor: np.ndarray) -> Any:
    pyarrow = pytest.importorskip("pyarrow")
    return pyarrow.table({"t [s]": np.arange(COUNT) / FS_HZ, "acc NDE [g]": other, "acc DE [g]": sensor})


def write_parquet(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    pytest.importorskip("pyarrow.parquet").write_table(table(other, sensor), path)


def write_feather(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    pytest.importorskip("pyarrow.feather").write_feather(table(other, sensor), path)


def write_npz(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    arrays = {"acc NDE": other, "acc DE": sensor, "fs": np.array(FS_HZ), "unit": np.array("g")}
    np.savez_compressed(path, **arrays, labels=np.array([None]))


def write_matlab(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    savemat(path, {"rec": {"acc_NDE": other, "acc_DE": sensor, "fs": FS_HZ, "unit": "g"}})


def write_hdf5(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    with h5py.File(path, "w") as file:
        for name, samples in (("acc NDE", other), ("acc DE", sensor * G)):
            file[name] = samples
            file[name].attrs.update({"unit": "g" if name == "acc NDE" else "m s-2", "sampling_rate": FS_HZ})


WRITERS: dict[str, tuple[Callable[[Path, np.ndarray, np.ndarray], None], dict[str, Any]]] = {
    "csv": (write_csv, {}),
    "tab": (write_tab, {}),
    "wav": (write_wav, {"channel": "data[2]", "unit": "g"}),
    "flac": (write_flac, {"channel": "data[2]", "unit": "V", "scale": FULL_SCALE_V, "sensitivity_mv_per_g": MV_PER_G}),
    "tdms": (write_tdms, {}),
    "uff": (write_uff, {}),
    "parquet": (write_parquet, {}),
    "feather": (write_feather, {}),
    "npz": (write_npz, {}),
    "matlab": (write_matlab, {"channel": "rec.acc_DE"}),
    "hdf5": (write_hdf5, {}),
}


@functools.cache
def whole(kind: str) -> bytes:
    """The file of a kind; skips visibly where the library that writes it is missing."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "x.npz")  # an ending that numpy does not add to
        WRITERS[kind][0](path, *record())
        return path.read_bytes()


def analysed(recording: Recording) -> Analysis:
    return analyse(recording, bearing=BEARING, band_hz=(1400.0, 2800.0))


@pytest.fixture(scope="module")
def direct() -> Analysis:
    """The same samples without any file."""
    made = record()[1] * G
    settings = {"channel": "data", "unit": "m/s2", "rpm": SHAFT_HZ * 60, "fs_hz": FS_HZ}
    return analysed(_saved(made, settings))


def _saved(samples: np.ndarray, settings: dict[str, Any]) -> Recording:
    with tempfile.TemporaryDirectory() as folder:
        np.save(Path(folder, "x.npy"), samples)
        return load_recording(Path(folder, "x.npy"), RecordingSettings(**settings))


@pytest.mark.parametrize("kind", WRITERS)
def test_the_same_lines_from_every_format(kind: str, tmp_path: Path, direct: Analysis) -> None:
    path = tmp_path / "record.dat"  # its name says nothing
    path.write_bytes(whole(kind))
    settings = RecordingSettings(**{"channel": "acc DE", "rpm": SHAFT_HZ * 60, **WRITERS[kind][1]})
    recording = load_recording(path, settings)
    assert recording.unit == "m/s2"
    assert recording.fs_hz == pytest.approx(FS_HZ, rel=LINE_DIGITS)
    samples = recording.channels[recording.channel or ""]
    np.testing.assert_allclose(samples, record()[1] * G, atol=DIGITS * G * np.abs(record()[1]).max())
    found = analysed(recording)
    assert [line.detected for line in found.lines] == [line.detected for line in direct.lines]
    assert found.line("BPFO").detected
    for line, same in zip(found.lines, direct.lines, strict=True):
        if line.detected:
            assert line.found_hz == pytest.approx(same.found_hz, rel=LINE_DIGITS)


@pytest.mark.parametrize("kind", [kind for kind in WRITERS if kind not in ("csv", "tab")])  # these know no length
@pytest.mark.parametrize("share", [0.999, 0.6, 0.01])
def test_a_file_that_was_cut(kind: str, share: float, tmp_path: Path) -> None:
    path, content = tmp_path / "cut.dat", whole(kind)
    path.write_bytes(content[: round(share * len(content))])
    with pytest.raises(DataError, match=r"truncated|damaged"):
        load_recording(path, RecordingSettings(**{"channel": "acc DE", "rpm": 1500.0, **WRITERS[kind][1]}))
    (entry,) = add(tmp_path).recordings
    assert entry.status in (FileStatus.TRUNCATED, FileStatus.UNREADABLE)


@pytest.mark.parametrize("kind", WRITERS)
def test_flipped_bits(kind: str, tmp_path: Path) -> None:
    """A refusal or a recording; never a wrong one where the format has a checksum of its samples."""
    rng, path = np.random.default_rng(len(kind)), tmp_path / "flipped.dat"
    settings = RecordingSettings(**{"channel": "acc DE", "rpm": 1500.0, **WRITERS[kind][1]})
    for i in range(8):
        content = bytearray(whole(kind))
        at = int(rng.integers(400 if i % 2 else 0, len(content)) if i % 2 else rng.integers(400))
        content[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(content)
        try:
            found = load_recording(path, settings)
        except DataError:
            continue
        if kind in ("flac", "npz"):
            np.testing.assert_allclose(
                found.channels[found.channel or ""], record()[1] * G, atol=DIGITS * G * np.abs(record()[1]).max()
            )


@pytest.mark.parametrize("kind", ["wav", "parquet"])
def test_a_library_that_is_missing_is_named(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "x.dat"
    path.write_bytes(whole(kind))
    limited.end_readers()
    (tmp_path / "broken").mkdir()
    library = detect_format(path).load.keywords["library"]  # type: ignore[attr-defined]
    (tmp_path / "broken" / f"{library.module.split('.')[0]}.py").write_text("raise ImportError('none here')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "broken"))
    with pytest.raises(DataError, match=rf'library {library.name}, .*pip install "srbval\[{library.extra}\]"'):
        load_recording(path)
    limited.end_readers()
