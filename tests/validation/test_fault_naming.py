"""Naming the fault of a record by itself, and what is said of it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.validation.analyse import analyse
from srbval.validation.fault_call import call_fault
from srbval.validation.fault_evidence import fault_evidence
from srbval.validation.fault_naming import fault_entry, known_features, name_fault
from srbval.validation.fault_posterior import CLASSES, OTHER
from tests.validation.test_fault_call import faulted_analysis
from tests.validation.test_shaft_speed import BEARING, record


def test_the_records_that_come_with_the_program() -> None:
    known = known_features()
    assert {k.state for k in known} == set(CLASSES)
    assert len({k.rig for k in known}) >= 6
    assert all(k.state == OTHER or np.isfinite(k.vector).all() for k in known)


def test_an_inner_race_fault_is_named_without_a_healthy_record() -> None:
    analysis = faulted_analysis()
    naming = name_fault(analysis)
    entry = fault_entry(call_fault(analysis), naming)
    assert (naming.most_probable, entry["called"], entry["state"]) == (Fault.INNER, Fault.INNER, "inner")
    assert sum(entry["probabilities"].values()) == pytest.approx(1)
    assert "inner" in naming.sentence


def test_noise_is_not_called() -> None:
    quiet = dataclasses.replace(record(shaft_hz=25.0, fault=False, seed=3), state=None)
    entry = fault_entry(call_fault(analysis := analyse(quiet, bearing=BEARING)), name_fault(analysis))
    assert entry["called"] is None


def test_a_wrong_speed_leaves_the_comb_unexplained_and_says_its_order() -> None:
    """At a speed 20 % too high the fault's comb stands at its own order over 1.2."""
    analysis = faulted_analysis()
    right = fault_evidence(analysis)
    speed = analysis.speed
    wrong = fault_evidence(
        dataclasses.replace(analysis, speed=dataclasses.replace(speed, value_hz=1.2 * speed.value_hz))
    )
    assert wrong.unexplained > right.unexplained + 2
    assert wrong.unexplained_order == pytest.approx(BEARING.orders.bpfi / 1.2, rel=0.01)
    assert max(wrong.contrasts) < max(right.contrasts) / 2


def test_of_what_is_not_measured_nothing_is_said() -> None:
    entry = fault_entry(call_fault(faulted_analysis()), None)
    assert (entry["called"], entry["state"], entry["probabilities"]) == (None, None, {})
