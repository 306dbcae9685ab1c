"""Kinematic orders of localized faults: pure rolling, stationary outer ring."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from srbval.errors import ConfigurationError
from srbval.storage.tables import Limited, limited, quantity

MAX_ORDER = 1000  # passages per shaft revolution
MOST_ROWS = 4


@dataclass(frozen=True, kw_only=True)
class FaultOrders(Limited):
    """Frequencies of the fault lines per shaft revolution, dimensionless.

    `bsf` is the rolling element's spin relative to the cage; a defect on it meets a race twice per spin, so its line is
    ``2xBSF``. `bpfo` + `bpfi` is the number of rolling elements of a row.
    """

    bpfo: float = limited(above=0, most=MAX_ORDER)
    bpfi: float = limited(above=0, most=MAX_ORDER)
    bsf: float = limited(above=0, most=MAX_ORDER)
    ftf: float = limited(above=0, most=MAX_ORDER)

    @classmethod
    def from_dimensions(
        cls, rolling_elements: int, element_diameter_m: float, pitch_diameter_m: float, contact_angle_rad: float
    ) -> FaultOrders:
        """Compute the orders from the dimensions (Randall, Vibration-based Condition Monitoring, 2011, sect. 2.2.3).

        ``rolling_elements`` counts one row. Assumes no slip and a stationary outer ring.
        """
        ratio = element_diameter_m / pitch_diameter_m * math.cos(contact_angle_rad)
        if not 0 < ratio < 1:
            raise ConfigurationError(
                f"element diameter {element_diameter_m:g} m on a pitch diameter of {pitch_diameter_m:g} m: the "
                f"ratio times cos(contact angle) is {ratio:.4g} and must be between 0 and 1."
            )
        chord = pitch_diameter_m * math.sin(math.pi / max(rolling_elements, 2))
        if element_diameter_m > chord:
            raise ConfigurationError(
                f"elements overlap: {rolling_elements} elements of {element_diameter_m:g} m have centres "
                f"{chord:.6g} m apart; count one row, and use fewer or smaller elements."
            )
        return cls(
            bpfo=rolling_elements / 2 * (1 - ratio),
            bpfi=rolling_elements / 2 * (1 + ratio),
            bsf=pitch_diameter_m / (2 * element_diameter_m) * (1 - ratio**2),
            ftf=(1 - ratio) / 2,
        )

    def at(self, shaft_hz: float) -> FaultFrequencies:
        """Compute the frequencies at a shaft speed of `shaft_hz` [Hz]."""
        lines = {f"{name}_hz": order * shaft_hz for name, order in vars(self).items()}
        return FaultFrequencies(shaft_hz=shaft_hz, **lines)


@dataclass(frozen=True, kw_only=True)
class FaultFrequencies:
    """Fault frequencies at one shaft speed [Hz]."""

    shaft_hz: float
    bpfo_hz: float
    bpfi_hz: float
    bsf_hz: float
    ftf_hz: float


class ElementShape(enum.StrEnum):
    """Shape of a rolling element: a ball touches its races in an ellipse, a roller along its length."""

    BALL = "ball"
    ROLLER = "roller"


@dataclass(frozen=True, kw_only=True)
class RollingElements(Limited):
    """Rolling elements: their number in one row, diameters and contact angle; other fields affect only contact forces.

    `outer_groove` and `inner_groove` are the radius of a raceway's groove divided by the ball diameter (usually 0.515
    to 0.53; quoted from memory, not checked). `length_m` is the contact length of a roller; if it is None, the roller
    diameter is used. All `rows` are alike, in phase, and share the load evenly.
    """

    rolling_elements: int = limited(least=1)
    element_diameter_m: float = quantity("length", above=0)
    pitch_diameter_m: float = quantity("length", above=0)
    contact_angle_rad: float = quantity("angle")
    shape: ElementShape = ElementShape.BALL
    rows: int = limited(least=1, most=MOST_ROWS, default=1)
    outer_groove: float = limited(least=0.502, most=0.6, default=0.52)
    inner_groove: float = limited(least=0.502, most=0.6, default=0.52)
    length_m: float | None = quantity("length", above=0, default=None)

    def __post_init__(self) -> None:
        super().__post_init__()
        assert self.orders.ftf > 0, "impossible dimensions are refused by the orders"
        if self.length_m is not None and self.length_m >= self.pitch_diameter_m:
            raise ConfigurationError(
                f"elements length_m = {self.length_m}, the contact length of a roller [m], must be below the pitch "
                f"diameter, {self.pitch_diameter_m:g} m."
            )

    @property
    def orders(self) -> FaultOrders:
        """Kinematic orders of pure rolling."""
        sizes = self.element_diameter_m, self.pitch_diameter_m, self.contact_angle_rad
        return FaultOrders.from_dimensions(self.rolling_elements, *sizes)


_SCENE_NONE = "none"  # no defect, in scene files, campaigns and on the command line


class Fault(enum.StrEnum):
    """Health state of a bearing: healthy, or the part that carries a localized defect.

    `line` is the name of the fault's line in the envelope spectrum (``BPFO``), `sidebands` the name of the frequency
    by which sidebands of this line are spaced (``FTF``; ``fr``: the shaft's), or None if there are no sidebands
    (Randall & Antoni 2011, Mech. Syst. Signal Process. 25, 485). `code` is the short form in tables and figures,
    `label` the part in words. ``Fault("none")`` is `HEALTHY`, ``Fault("ball")`` is `ROLLER`.
    """

    line: str | None
    sidebands: str | None
    code: str
    label: str

    def __new__(cls, value: str, *properties: str | None) -> Fault:
        """Create a member with its properties (see class); ``Fault("outer")`` returns an existing member."""
        member = str.__new__(cls, value)
        member._value_ = value
        vars(member).update(zip(("line", "sidebands", "code", "label"), properties, strict=True))
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
        """Find the fault that a line indicates; None for a line that indicates no fault (``FTF``)."""
        return next((fault for fault in DEFECTS if fault.line == line), None)

    @property
    def scene_word(self) -> str:
        """Word for the fault in scene files: ``none`` for a healthy bearing, otherwise the member's value."""
        return _SCENE_NONE if self is Fault.HEALTHY else self.value

    def line_order(self, orders: FaultOrders) -> float:
        """Look up the kinematic order of the fault's line per shaft revolution; `KeyError` for a healthy bearing."""
        return {Fault.OUTER: orders.bpfo, Fault.INNER: orders.bpfi, Fault.ROLLER: 2 * orders.bsf}[self]

    def sideband_order(self, orders: FaultOrders) -> float:
        """Return the sideband spacing around the fault's line, divided by the shaft frequency; 0 without sidebands."""
        return {Fault.INNER: 1.0, Fault.ROLLER: orders.ftf}.get(self, 0.0)

    def passing_order(self, rolling_elements: int, cage_ratio: float) -> float | None:
        """Compute how many elements pass a race's defect per shaft revolution; `cage_ratio`: cage / shaft speed.

        The result is the order of the fault line with slip; None if the defect is not on a race.
        """
        return {Fault.OUTER: rolling_elements * cage_ratio, Fault.INNER: rolling_elements * (1 - cage_ratio)}.get(self)


DEFECTS = tuple(fault for fault in Fault if fault is not Fault.HEALTHY)
RACE_DEFECTS = (Fault.OUTER, Fault.INNER)
