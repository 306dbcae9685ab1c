"""Kernels called as machine code: the same numbers as in plain Python, whatever the form of the arguments."""

from collections import namedtuple

import numpy as np
import pytest

from srbval.models import jit

Inner = namedtuple("Inner", ["scale", "table", "absent"])
Model = namedtuple("Model", ["inner", "count", "double", "weights"])


def weigh(model, absent, values, out):
    """Fill `out` from arrays of two shapes, numbers of three kinds and a nested tuple; `absent`: array or None."""
    for i in range(model.count):
        out[i] = model.inner.scale * model.inner.table[i, 1] + values[i]
        for weight in model.weights:
            out[i] += weight[i]
        if model.double:
            out[i] *= 2.0
    if absent is not None:
        out[0] = absent[0]


def model_of(table, **changes):
    weights = (np.arange(3.0), np.array([5.0, 6.0, 7.0]))
    return Model(Inner(0.5, table, None), 3, True, weights)._replace(**changes)


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kernels")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jit, "kernel_cache_folder", lambda: folder)
        return jit.kernel(weigh), folder


TABLE = np.arange(12.0).reshape(4, 3)
READ_ONLY = TABLE.copy()
READ_ONLY.flags.writeable = False


@pytest.mark.parametrize(
    ("model", "absent"),
    [
        (model_of(TABLE), None),
        (model_of(np.asfortranarray(TABLE), count=np.int64(2)), None),
        (model_of(np.repeat(TABLE, 2, axis=1)[:, ::2], double=False), None),
        (model_of(READ_ONLY, double=False), np.array([-3.0])),
    ],
    ids=["plain", "columns first", "every second column", "read only"],
)
def test_the_numbers_are_those_of_plain_python(model, absent, compiled):
    expected, found = np.zeros(3), np.zeros(3)
    weigh(model, absent, np.linspace(0.0, 1.0, 6)[::2], expected)
    compiled[0](model, absent, np.linspace(0.0, 1.0, 6)[::2], found)
    assert found.tolist() == expected.tolist()
    assert expected.any()


def test_a_changed_array_in_a_tuple_is_seen_and_every_form_has_a_file(compiled):
    kernel, folder = compiled
    table, found, files = TABLE.copy(), np.zeros(3), []
    model = model_of(table)
    for added, absent in ((0.0, None), (1.0, None), (1.0, np.ones(1))):
        table += added
        expected = np.zeros(3)
        weigh(model, absent, np.ones(3), expected)
        kernel(model, absent, np.ones(3), found)
        assert found.tolist() == expected.tolist()
        files.append(len(list(folder.iterdir())))
    assert np.diff(files).tolist() == [0, 1]
