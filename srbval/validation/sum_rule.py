"""BPFO + BPFI = Z f_shaft, whatever the slip: a check on the shaft speed that needs no tachometer.

Each roller passes the outer race at the cage's speed and the inner race at the shaft's less the cage's; the cage
drops out of the sum (Randall 2011, sect. 2.2.3). So slip cannot lower both lines, and a pair that does not add up
was not taken at one and the same stated speed. Where the two lines come from two records, what the cage slips more
in one than in the other stays in the sum.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class SumRule:
    """One pair of race lines, as orders of the shaft speed each was taken at.

    `ci95` are 95 % half widths, None where the source states none. `stated_rpm` is the speed the orders refer
    to, `implied_rpm` the one that would make the sum exactly `rolling_elements`. `slip_difference` is what the
    cage speeds of the two records differ by, in orders, where they are known; it is taken off before `closed`.
    """

    source: str
    origin: str
    rolling_elements: int
    bpfo_order: float
    bpfi_order: float
    ci95: float | None
    stated_rpm: float
    slip_difference: float = 0.0

    @property
    def total(self) -> float:
        """Sum of the two orders."""
        return self.bpfo_order + self.bpfi_order

    @property
    def difference_pct(self) -> float:
        """Sum against the number of rolling elements [%]."""
        return 100 * (self.total / self.rolling_elements - 1)

    @property
    def implied_rpm(self) -> float:
        """Shaft speed at which the sum would be exact [rpm]."""
        return self.stated_rpm * self.total / self.rolling_elements

    @property
    def closed(self) -> bool | None:
        """Whether the sum agrees within its uncertainty; None without one."""
        return (
            None
            if self.ci95 is None
            else bool(abs(self.total - self.slip_difference - self.rolling_elements) <= self.ci95)
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``."""
        names = ("total", "difference_pct", "implied_rpm", "closed")
        return dataclasses.asdict(self) | {name: getattr(self, name) for name in names}


def sum_rule(
    source: str,
    origin: str,
    rolling_elements: int,
    *,
    bpfo_hz: float,
    bpfi_hz: float,
    outer_shaft_hz: float,
    inner_shaft_hz: float,
    ci95: tuple[float, float] | None = None,
    slip_difference: float = 0.0,
) -> SumRule:
    """The rule for a pair of lines [Hz], each at its own shaft speed [Hz]; `ci95` are those of the two orders."""
    return SumRule(
        source=source,
        origin=origin,
        rolling_elements=rolling_elements,
        bpfo_order=bpfo_hz / outer_shaft_hz,
        bpfi_order=bpfi_hz / inner_shaft_hz,
        ci95=None if ci95 is None else math.hypot(*ci95),
        stated_rpm=60 * (outer_shaft_hz + inner_shaft_hz) / 2,
        slip_difference=slip_difference,
    )
