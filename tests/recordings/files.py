"""Files in the layouts of other programs, written for the tests without the package's own writers."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

FS_HZ = 20480.0


def vibration(n: int = 4096, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, 1, n)


def excerpt(path: Path, **changes: Any) -> Path:
    """Write a file in the layout of the rig's open excerpts."""
    acceleration = vibration()
    values = {"acc_m_s2": acceleration, "acc_g": acceleration / 9.80665, "time_acc": np.arange(4096) / FS_HZ}
    values |= {"fs_acc": FS_HZ, "rpm": 858.0 + 0.5 * vibration(128, 1), "time_rpm": np.arange(128) / 640}
    values |= {"fs_rpm": 640.0, "mean_rpm": 858.0, "condition": "OR", "rpm_nominal": 877}
    savemat(path, values | changes, oned_as="column")
    return path


def cwru(path: Path, number: str, *, rpm: int | None = 1796, ends: tuple[str, ...] = ("DE", "FE")) -> Path:
    values: dict[str, Any] = {f"X{number}_{end}_time": vibration(seed=i)[:, None] for i, end in enumerate(ends)}
    if rpm is not None:
        values[f"X{number}RPM"] = np.array([[rpm]], dtype=np.uint16)
    savemat(path, values)
    return path


def mfpt(path: Path, load: Any = 100.0) -> Path:
    bearing = {"gs": vibration()[:, None], "sr": 48828.0, "rate": 25.0, "load": load}
    savemat(path, {"bearing": bearing, "BPFO": 81.125, "FTF": 14.8375}, do_compression=True)
    return path


def nested(value: Any) -> np.ndarray:
    """Wrap a value in a 1 x 1 object array, as scipy represents MATLAB's cells."""
    box = np.empty((1, 1), dtype=object)
    box[0, 0] = value
    return box


def signal_struct(values: np.ndarray, label: str, factor: float | None, increment: float) -> dict[str, Any]:
    """One quantity of a file in the rig's full layout, as a struct."""
    quantity: dict[str, Any] = {"label": nested(label)}
    if factor is not None:
        quantity["unit_transformation"] = {"factor": factor, "offset": 0.0}
    return {
        "x_values": {"start_value": 0.0, "increment": increment, "number_of_values": float(len(values))},
        "y_values": {"values": nested(values), "quantity": quantity},
        "function_record": {"name": "time record"},
    }


def rig_signals(*, speed_rpm: float = 700.0, speed_fs_hz: float = 100.0) -> dict[str, Any]:
    """Signals of a rig file: temperatures, the speed in rad/s, then four accelerometers in m/s2 with the label g."""
    sensors = np.stack([vibration(seed=i) * (i + 1) for i in range(4)], axis=1)
    count = int(4096 / FS_HZ * speed_fs_hz)
    speed = (speed_rpm + 0.3 * vibration(count, 9)) * np.pi / 30
    return {
        "Signal_1": signal_struct(40 + np.zeros((count, 4)), "°C", 1.0, 1 / speed_fs_hz),
        "Signal_2": signal_struct(speed[:, None], "rpm", 9.5493, 1 / speed_fs_hz),
        "Signal_3": signal_struct(sensors, "g", 0.1020, 1 / FS_HZ),
    }


def rig_v5(path: Path, signals: dict[str, Any]) -> Path:
    savemat(path, signals)
    return path


def rig_v73(path: Path, signals: dict[str, Any]) -> Path:
    """Write the rig's signals as MATLAB v7.3 with mat-io: groups, transposed arrays, references to cells."""
    pytest.importorskip("matio").save_to_mat(str(path), signals, version="v7.3")
    return path
