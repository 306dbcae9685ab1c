"""No function that simulates or analyses runs while the report is drawn."""

from __future__ import annotations

from .whole import HostileReport

OWN_ROOMS = {
    "report",
    "figures",
    "errors",
    "storage",
    "progress",
    "bearing",
    "scene",
}  # their functions draw, word or describe


def test_nothing_is_computed_while_the_report_is_drawn(hostile_report: HostileReport) -> None:
    """Methods and properties of the evidence are data; every other function that runs is the report's own."""
    foreign = {
        f"{room}: {function}"
        for room, function in hostile_report.functions_called
        if room not in OWN_ROOMS and "." not in function and function != "<module>"
    }
    assert ("report", "assemble") in hostile_report.functions_called
    assert foreign == set()
