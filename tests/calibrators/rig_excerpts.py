"""The rig's open excerpts in compact form, as they ship: ``python -m tests.calibrators.rig_excerpts FOLDER``.

FOLDER holds the originals, as ``srbval data fetch torino-excerpts`` brings them, with the licence. Accelerations become
single precision, shuffled and compressed; of the speed, which some originals hold interpolated to the rate of the
accelerations, every 32nd value stays: 640 Hz, the rate at which the others have it. What can be computed from the rest
(accelerations in g, both times) is left out. Nothing is filtered.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import h5py
import numpy as np

from srbval.recordings.datasets.description import dataset
from srbval.recordings.load import sha256_of
from srbval.recordings.loaders.matlab_v5 import load_matlab_v5
from srbval.storage.own_package import shipped_folder

SHIPPED = ("H_353rpm", "H_877rpm", "IR_877rpm", "OR_877rpm", "Roller_877rpm")
SPEED_HZ = 640.0
LICENCE = "LICENSE.txt"


def make(originals: Path, folder: Path) -> None:
    """Write the compact form of each of `SHIPPED`, which must be those published, and the licence to `folder`."""
    description = dataset("torino-excerpts")
    published = {file.name: file for file in description.files}
    for name in (f"{stem}_sample" for stem in SHIPPED):
        original, sha256 = originals / f"{name}.mat", sha256_of(originals / f"{name}.mat")
        assert sha256 == published[original.name].sha256, f"{original} is not the published file"
        raw = load_matlab_v5(original)
        every = round((raw.number("fs_rpm") or 0.0) / SPEED_HZ)
        with h5py.File(folder / f"{name}.h5", "w") as file:
            for key, values in (("acc_m_s2", raw.signal("acc_m_s2")), ("rpm", raw.signal("rpm")[::every])):
                packed = {"shuffle": True, "compression": "gzip", "compression_opts": 9, "fletcher32": True}
                file.create_dataset(key, data=values.astype(np.float32), chunks=values.shape, **packed)
            file["fs_acc"], file["fs_rpm"], file["mean_rpm"] = raw.number("fs_acc"), SPEED_HZ, raw.number("mean_rpm")
            file["condition"], file["rpm_nominal"] = raw.text("condition"), raw.number("rpm_nominal")
            file.attrs["copy_of"] = f"{original.name}, SHA-256 {sha256}, in single precision with the speed at 640 Hz"
            file.attrs["source"] = published[original.name].url
            file.attrs["licence"] = f"{description.licence}; see {LICENCE}"
    shutil.copyfile(originals / LICENCE, folder / LICENCE)


if __name__ == "__main__":
    make(Path(sys.argv[1]), shipped_folder("data_manifest/rig_excerpts"))
