"""MATLAB v5 files: what scipy writes is read as stored; bombs end in a refusal, in the process that reads."""

import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from srbval.errors import DataError
from srbval.recordings.loaders import detect_format, limited
from srbval.recordings.loaders.arrays import MATLAB, load_matlab

from . import files
from .damage import MATLAB_HEADER

NUMBER_KINDS = ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8"]


@pytest.mark.parametrize("compressed", [False, True])
def test_numbers_of_every_kind_and_shape(tmp_path: Path, compressed: bool) -> None:
    rng = np.random.default_rng(0)
    written = {
        f"{kind}_{i}": rng.integers(0, 100, shape).astype(kind)
        for kind in NUMBER_KINDS
        for i, shape in enumerate([(1, 1), (3, 1), (1, 3), (4, 5), (2, 3, 4)])
    }
    savemat(tmp_path / "a.mat", written, do_compression=compressed)
    read = load_matlab(tmp_path / "a.mat").variables
    assert list(read) == list(written)
    for name, values in written.items():
        np.testing.assert_array_equal(read[name], values)
        assert read[name].dtype == values.dtype  # type: ignore[union-attr]


def test_structs_cells_and_texts(tmp_path: Path) -> None:
    from scipy.sparse import eye_array

    pair = np.empty((1, 2), dtype=object)
    pair[0, :] = [np.arange(3.0), "second"]
    written = {
        "s": {"x": np.eye(2), "inner": {"label": "grün", "n": 7}},
        "box": files.nested(files.nested(np.arange(4.0))),
        "pair": pair,
        "table": np.array([(1.0, 2.0), (3.0, 4.0)], dtype=[("a", "f8"), ("b", "f8")]),
        "empty": np.zeros((0, 3)),
        "sparse": eye_array(5).tocsc(),
        "complex": np.ones(3) * 1j,
    }
    savemat(tmp_path / "a.mat", written, oned_as="column")
    raw = load_matlab(tmp_path / "a.mat")
    np.testing.assert_array_equal(raw.variables["s.x"], np.eye(2))
    assert (raw.text("s.inner.label"), raw.number("s.inner.n")) == ("grün", 7)
    np.testing.assert_array_equal(np.ravel(raw.variables["box"]), np.arange(4.0))
    np.testing.assert_array_equal(np.ravel(raw.variables["pair(1)"]), np.arange(3.0))
    assert raw.text("pair(2)") == "second"
    assert [raw.number(f"table({i}).{field}") for i in (1, 2) for field in "ab"] == [1, 2, 3, 4]
    assert np.size(raw.variables["empty"]) == 0
    assert not {"sparse", "complex"} & set(raw.variables)


def test_big_endian_file(tmp_path: Path) -> None:
    values = np.arange(5.0)
    body = struct.pack(">IIII", 6, 8, 6, 0) + struct.pack(">IIii", 5, 8, 5, 1)
    body += struct.pack(">II", 1, 1) + b"x".ljust(8, b"\0") + struct.pack(">II", 9, 40) + values.astype(">f8").tobytes()
    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x01\x00MI"
    (tmp_path / "a.mat").write_bytes(header + struct.pack(">II", 14, len(body)) + body)
    assert detect_format(tmp_path / "a.mat") is MATLAB
    np.testing.assert_array_equal(load_matlab(tmp_path / "a.mat").signal("x"), values)


def array(name: bytes, data: bytes, dimensions: tuple[int, int]) -> bytes:
    """An array of doubles: flags, dimensions, name and numbers, packed."""
    parts = ((6, struct.pack("<II", 6, 0)), (5, struct.pack("<2i", *dimensions)), (1, name), (9, data))
    body = b"".join(struct.pack("<II", kind, len(part)) + part + bytes(-len(part) % 8) for kind, part in parts)
    packed = zlib.compress(struct.pack("<II", 14, len(body)) + body, 1)
    return struct.pack("<II", 15, len(packed)) + packed


def nested_structs(depth: int, fields: int) -> bytes:
    """Structs of one element within each other, each with as many fields as its name table has bytes."""
    body = struct.pack("<IIII", 14, 48, 6, 8) + struct.pack("<II", 6, 0) + struct.pack("<IIii", 5, 8, 1, 1) + bytes(16)
    for _ in range(depth):
        head = struct.pack("<IIII", 6, 8, 2, 0) + struct.pack("<IIii", 5, 8, 1, 1) + struct.pack("<II", 1, 0)
        head += struct.pack("<IIi4x", 5, 4, 1) + struct.pack("<II", 1, fields) + b"f" * fields + bytes(-fields % 8)
        body = struct.pack("<II", 14, len(head) + len(body)) + head + body
    return body


BIG = 2**21
MATLAB_BOMBS: dict[str, Callable[[], bytes]] = {
    "arrays of zeros": lambda: b"".join(array(b"w%d" % i, bytes(8 * BIG), (BIG, 1)) for i in range(10)),
    "many compressed elements": lambda: b"".join(array(b"v%d" % i, bytes(8), (1, 1)) for i in range(3000)),
    "many fields in nested structs": lambda: nested_structs(20, 60_000),
    "structs without end": lambda: nested_structs(8_000, 1),
    **{
        f"dimensions {shape}": lambda shape=shape: array(b"x", bytes(8), shape)
        for shape in ((2**31 - 1, 2**31 - 1), (2**30, 1), (-1, 1))
    },
}


@pytest.mark.parametrize("bomb", MATLAB_BOMBS.values(), ids=MATLAB_BOMBS.keys())
def test_a_bomb_is_read_or_refused_within_the_limits(
    tmp_path: Path, bomb: Callable[[], bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limited, "COMPUTING_S", 1.0)
    (tmp_path / "a.mat").write_bytes(MATLAB_HEADER + bomb())
    try:
        raw = MATLAB.load(tmp_path / "a.mat")
    except DataError as error:
        assert "\n" not in str(error)  # noqa: PT017
    else:
        held = sum(np.asarray(value).nbytes for value in raw.variables.values())
        assert held < 4 * (tmp_path / "a.mat").stat().st_size + 2**28
