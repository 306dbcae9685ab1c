"""The net must see what it is there to see, and nothing else."""

import pytest

from tests.net.difference import differences

OLD = {"value": 1.0, "wall_s": 3.0, "lines": ["a", "b"], "tables": [{"id": "x", "n": 1}, {"id": "y", "n": 2}]}


def test_nothing_differs() -> None:
    same = {**OLD, "value": 1.0 + 1e-13, "wall_s": 4.0, "tables": OLD["tables"][::-1]}
    assert not list(differences(OLD, same, 1e-12))


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"value": 1.0 + 1e-10}, "/value: 1.0 ->"),
        ({"value": None}, "/value: 1.0 -> None"),
        ({"value": True}, "/value: 1.0 -> True"),
        ({"lines": ["a", "c"]}, "/lines: -b"),
        ({"lines": ["a"]}, "/lines: -b"),
        ({"tables": [{"id": "y", "n": 2}]}, "/tables/x: gone"),
        ({"tables": [{"id": "x", "n": 1}, {"id": "y", "n": 3}]}, "/tables/y/n: 2 -> 3"),
        ({"more": 1}, "/more: new: 1"),
    ],
)
def test_a_difference_is_told(change: dict, told: str) -> None:
    found = list(differences(OLD, OLD | change, 1e-12))
    assert found
    assert found[0].startswith(told)


def test_bit_for_bit() -> None:
    assert list(differences({"a": 1.0}, {"a": 1.0 + 2.3e-16}, 0.0))
