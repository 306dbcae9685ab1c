"""MATLAB v5 files: what scipy writes is read as stored."""

from pathlib import Path

import numpy as np
from scipy.io import savemat

from srbval.recordings.loaders.arrays import load_matlab

from . import files


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
