"""The reference file: read strictly, written whole, renewed only by what a sound run gives."""

import math
from pathlib import Path

import pytest

from srbval.check.check import (
    CheckedQuantity,
    CheckResult,
    ReferenceQuantity,
    differences,
    read_reference,
    renewed,
    write_reference,
)
from srbval.errors import ConfigurationError

REPORTS = Path(__file__).parents[2] / "reports"


def reference(name: str = "a", value: float | None = 1.0, tolerance: float = 0.01) -> ReferenceQuantity:
    return ReferenceQuantity(
        name=name, value=value, tolerance=tolerance, unit="m", reason="it scatters by half of that"
    )


def checked(name: str = "a", value: float = 1.0, low: float = 0.99, high: float = 1.01) -> CheckedQuantity:
    return CheckedQuantity(name=name, value=value, low=low, high=high, unit="m", reason="it scatters by half of that")


def test_every_quantity_has_a_value_a_tolerance_and_a_reason() -> None:
    for quantity in read_reference(REPORTS / "reference.json").values():
        assert quantity.value is not None, quantity.name
        assert len(quantity.reason.split()) > 3, quantity.name


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    quantities = {"a": reference(), "b": reference("b", None, 0.0)}
    write_reference(tmp_path / "reference.json", quantities)
    assert read_reference(tmp_path / "reference.json") == quantities


def test_a_tolerance_without_a_reason_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="needs its reason"):
        ReferenceQuantity(name="a", tolerance=0.1, unit="m", reason=" ")


@pytest.mark.parametrize(
    ("value", "low", "high"), [(1.02, 0.99, 1.01), (math.nan, 0.9, 1.1), (1.0, math.nan, math.nan)]
)
def test_only_what_lies_within_is_ok(value: float, low: float, high: float) -> None:
    assert not checked(value=value, low=low, high=high).ok


def test_renewing_keeps_tolerances_and_what_was_skipped() -> None:
    old = {"a": reference(), "b": reference("b", 5.0)}
    new = renewed(old, CheckResult(checks=(checked(value=1.234567),), skipped=("b",)))
    assert new == {"a": reference(value=1.2346), "b": old["b"]}
    (change,) = differences(old, new)
    assert (change["old"], change["new"], change["moved"]) == (1.0, 1.2346, pytest.approx(23.46))


@pytest.mark.parametrize(
    ("old", "value", "why"),
    [({"a": reference()}, math.nan, "could not be computed"), ({}, 1.0, "no tolerance and no reason")],
)
def test_no_reference_is_made_of_a_failure_or_without_a_tolerance(
    old: dict[str, ReferenceQuantity], value: float, why: str
) -> None:
    with pytest.raises(ConfigurationError, match=why):
        renewed(old, CheckResult(checks=(checked(value=value),), skipped=()))
