"""Rolling elements of a bearing of any kind: what its kinematics follows from, and what its contacts need."""

import enum
import math
from dataclasses import dataclass

from srbval.bearing.kinematics import FaultOrders
from srbval.errors import ConfigurationError
from srbval.storage.tables import Checked, limited, quantity

MOST_ROWS = 4


class ElementShape(enum.StrEnum):
    """A ball touches its races in an ellipse, a roller along its length."""

    BALL = "ball"
    ROLLER = "roller"


@dataclass(frozen=True, kw_only=True)
class RollingElements(Checked):
    """Number in one row, diameters and contact angle; the others matter for contacts alone, and have usual values.

    `outer_groove`, `inner_groove`: radius of the groove in which a ball runs over the ball's diameter (0.515 to 0.53
    are usual; quoted from memory, not checked). `length_m`: of a roller's contact, without it as long as the roller is
    thick. All `rows` are alike, in phase, and share the load evenly.
    """

    rolling_elements: int
    element_diameter_m: float = quantity("length")
    pitch_diameter_m: float = quantity("length")
    contact_angle_rad: float = quantity("angle")
    shape: ElementShape = ElementShape.BALL
    rows: int = limited(least=1, most=MOST_ROWS, default=1)
    outer_groove: float = limited(least=0.502, most=0.6, default=0.52)
    inner_groove: float = limited(least=0.502, most=0.6, default=0.52)
    length_m: float | None = quantity("length", above=0, default=None)

    def __post_init__(self) -> None:
        assert self.orders.ftf > 0, "impossible dimensions are refused by the orders"
        super().__post_init__()
        if self.length_m is not None and self.length_m >= self.pitch_diameter_m:
            raise ConfigurationError(
                f"elements length_m = {self.length_m} must be below the pitch diameter, {self.pitch_diameter_m:g} m."
            )
        chord = self.pitch_diameter_m * math.sin(math.pi / max(self.rolling_elements, 2))
        if self.element_diameter_m > chord:
            raise ConfigurationError(
                f"elements overlap: {self.rolling_elements} of {self.element_diameter_m:g} m are {chord:.6g} m "
                "apart; count one row, and use fewer or smaller ones."
            )

    @property
    def orders(self) -> FaultOrders:
        """Kinematic orders of pure rolling."""
        return FaultOrders.from_dimensions(
            rolling_elements=self.rolling_elements,
            element_diameter_m=self.element_diameter_m,
            pitch_diameter_m=self.pitch_diameter_m,
            contact_angle_rad=self.contact_angle_rad,
        )

    @property
    def ratio(self) -> float:
        """Element diameter over pitch diameter times the cosine of the contact angle, gamma."""
        return self.element_diameter_m / self.pitch_diameter_m * math.cos(self.contact_angle_rad)

    @property
    def contact_length_m(self) -> float:
        """Length of a roller's contact."""
        return self.element_diameter_m if self.length_m is None else self.length_m
