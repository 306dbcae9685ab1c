"""Small recordings, sound and damaged, the same on every occasion."""

import io
from pathlib import Path

import h5py
import numpy as np
from scipy.io import savemat, wavfile

from tests.recordings.damage import Damage

FS_HZ = 4096
MAT_HEADER = 116  # bytes of text that open a MAT file, the date of writing among them


def write_sample(folder: Path) -> None:
    """The sound files, ``sample.npy`` and so on."""
    for ending, content in _sound().items():
        (folder / f"sample.{ending}").write_bytes(content)


def write_corpus(folder: Path) -> list[str]:
    """The first damaged files of `tests/recordings/damage.py`, every format times every damage; their names."""
    (folder / "whole").mkdir()
    damage = Damage(folder / "whole", folder / "executed")
    names = [f"damaged-{number}.mat" for number in range(len(damage.cells))]
    for number, name in enumerate(names):
        damage.write(number, folder / name)
    return names


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
