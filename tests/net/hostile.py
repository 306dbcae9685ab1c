"""Small recordings, sound and damaged, the same on every occasion."""

import io
from pathlib import Path

import h5py
import numpy as np
from scipy.io import savemat, wavfile

FS_HZ = 4096
MAT_HEADER = 116  # bytes of text that open a MAT file, the date of writing among them
SHARES = (0.0, 0.02, 0.5, 0.98)  # of a file that are left
HEAD_BYTES = (0, 5, 60, 130, 200)  # places near a file's beginning where a byte is changed
SPREAD = 40  # bytes changed all over a file


def write_sample(folder: Path) -> None:
    """The sound files, ``sample.npy`` and so on."""
    for ending, content in _sound().items():
        (folder / f"sample.{ending}").write_bytes(content)


def write_corpus(folder: Path) -> list[str]:
    """Sound, damaged and odd files in `folder`; their names."""
    rng, files = np.random.default_rng(22240), {}
    for ending, content in _sound().items():
        name = ending.replace(".", "-")
        files[f"sound-{name}.{ending}"] = content
        for share in SHARES:
            files[f"{name}-cut-{share:g}.{ending}"] = content[: int(share * len(content))]
        for place in HEAD_BYTES:
            files[f"{name}-byte-{place}.{ending}"] = _changed(content, np.array([place]), rng)
        files[f"{name}-spread.{ending}"] = _changed(content, rng.integers(0, len(content), SPREAD), rng)
        files[f"{name}-noise.{ending}"] = rng.bytes(3000)
    files |= _odd()
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return list(files)


def _changed(content: bytes, places: np.ndarray, rng: np.random.Generator) -> bytes:
    changed = np.frombuffer(content, dtype=np.uint8).copy()
    changed[places] ^= rng.integers(1, 256, len(places), dtype=np.uint8)
    return changed.tobytes()


def _signal() -> np.ndarray:
    """One second: decaying impacts at the outer-race line in noise."""
    time, rng = np.arange(FS_HZ) / FS_HZ, np.random.default_rng(710)
    since = np.mod(time, 1 / 96.7)
    return np.asarray(np.exp(-400 * since) * np.sin(2 * np.pi * 1200 * since) + 0.05 * rng.standard_normal(FS_HZ))


def _sound() -> dict[str, bytes]:
    signal = _signal()
    npy, wav, mat, hdf5 = io.BytesIO(), io.BytesIO(), io.BytesIO(), io.BytesIO()
    np.save(npy, signal)
    wavfile.write(wav, FS_HZ, np.round(signal * 8000).astype(np.int16))
    savemat(mat, {"vib": signal.reshape(-1, 1), "fs": float(FS_HZ)})
    with h5py.File(hdf5, "w", userblock_size=512) as file:  # a MAT file of version 7.3
        file.create_dataset("vib", data=signal.reshape(1, -1)).attrs["MATLAB_class"] = np.bytes_("double")
    rows = "".join(f"{i / FS_HZ:.9f},{value:.9f}\n" for i, value in enumerate(signal.tolist()))
    v73 = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + hdf5.getvalue()[128:]
    return {
        "npy": npy.getvalue(),
        "wav": wav.getvalue(),
        "mat": b"MATLAB 5.0 MAT-file".ljust(MAT_HEADER) + mat.getvalue()[MAT_HEADER:],
        "v73.mat": v73,
        "csv": ("time_s,acceleration\n" + rows).encode(),
    }


def _odd() -> dict[str, bytes]:
    """Readable files with content that is no recording."""
    odd = {}
    for name, values in {
        "zeros": np.zeros(FS_HZ), "one-value": np.ones(1), "nan": np.where(np.arange(FS_HZ) == 9, np.nan, _signal()),
        "infinite": np.where(np.arange(FS_HZ) == 9, np.inf, _signal()), "huge": 1e300 * _signal(),
        "complex": _signal() * 1j, "words": np.array(["a", "b"]), "cube": np.zeros((8, 8, 8)),
        "columns": np.tile(_signal(), (3, 1)).T,
    }.items():  # fmt: skip
        file = io.BytesIO()
        np.save(file, values)
        odd[f"odd-{name}.npy"] = file.getvalue()
    return odd | {
        "odd-latin.csv": "zeit;schwing\xb5\n1;2\n".encode("latin-1"),
        "odd-header-only.csv": b"time_s,acceleration\n",
        "odd-uneven.csv": b"time_s,a\n0,1\n1\n2,3,4\n",
        "odd-backwards.csv": b"time_s,a\n" + b"".join(b"%d,1.5\n" % (500 - i) for i in range(500)),
        "odd-ending.xyz": b"1 2 3\n",
        "no-ending": b"1 2 3\n4 5 6\n",
    }
