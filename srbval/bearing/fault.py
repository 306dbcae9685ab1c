"""The localized faults of a rolling bearing: one enum for declared states, simulated defects and calls."""

from __future__ import annotations

import enum

from srbval.bearing.kinematics import FaultOrders

_SCENE_NONE = "none"  # how scene files, campaigns and the command line say that there is no defect


class Fault(enum.StrEnum):
    """Health state of a bearing: healthy, or the part that carries a localized defect.

    `line` names the fault's line in the envelope spectrum and `sidebands` the spacing of the sidebands about it
    (Randall & Antoni 2011, Mech. Syst. Signal Process. 25, 485), None where there are none; `code` is the short form
    used in tables and in file names of the paper's rig, `label` the part in words. ``Fault("none")`` is `HEALTHY`,
    ``Fault("ball")`` is `ROLLER`.
    """

    line: str | None
    sidebands: str | None
    code: str
    label: str

    def __new__(
        cls, value: str, line: str | None = None, sidebands: str | None = None, code: str = "", label: str = ""
    ) -> Fault:
        """One member with its properties; ``Fault("outer")`` is a look-up and needs the value only."""
        member = str.__new__(cls, value)
        member._value_ = value
        member.line, member.sidebands, member.code, member.label = line, sidebands, code, label
        return member

    HEALTHY = "healthy", None, None, "H", "healthy"
    OUTER = "outer", "BPFO", None, "OR", "outer race"
    INNER = "inner", "BPFI", "fr", "IR", "inner race"
    ROLLER = "roller", "2xBSF", "FTF", "B", "rolling element"

    @classmethod
    def _missing_(cls, value: object) -> Fault | None:
        return {_SCENE_NONE: cls.HEALTHY, "ball": cls.ROLLER}.get(str(value))

    @classmethod
    def of_line(cls, line: str) -> Fault | None:
        """The fault that a line points to, None for lines of no fault (``FTF``)."""
        return next((fault for fault in DEFECTS if fault.line == line), None)

    @property
    def scene_word(self) -> str:
        """How scenes say it: ``none`` for a healthy bearing, else the value."""
        return _SCENE_NONE if self is Fault.HEALTHY else self.value

    def line_order(self, orders: FaultOrders) -> float:
        """Kinematic order of the line, per shaft revolution; `KeyError` for a healthy bearing, which has none."""
        return {Fault.OUTER: orders.bpfo, Fault.INNER: orders.bpfi, Fault.ROLLER: 2 * orders.bsf}[self]

    def sideband_order(self, orders: FaultOrders) -> float:
        """Spacing of the sidebands in orders: how often the defect passes through the load zone; 0 without any."""
        return {Fault.INNER: 1.0, Fault.ROLLER: orders.ftf}.get(self, 0.0)

    def passing_order(self, rolling_elements: int, cage_ratio: float) -> float | None:
        """Rolling elements that pass a defect per shaft revolution, from the cage's speed over the shaft's.

        That is the line's order with slip; None where the defect is on no race.
        """
        ratio = {Fault.OUTER: cage_ratio, Fault.INNER: 1 - cage_ratio}.get(self)
        return None if ratio is None else rolling_elements * ratio


DEFECTS = tuple(fault for fault in Fault if fault is not Fault.HEALTHY)
RACE_DEFECTS = (Fault.OUTER, Fault.INNER)
