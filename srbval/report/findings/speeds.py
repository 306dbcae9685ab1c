"""The rig's published shaft speeds, and the paper's two rig lines taken as one speed."""

from dataclasses import dataclass

from srbval.bearing import Bearing, Fault
from srbval.comparison.comparison import deviation_pct
from srbval.comparison.speed_and_slip import one_speed_reading, published_speeds
from srbval.comparison.table6 import Table6


@dataclass(frozen=True, kw_only=True)
class SingleSpeed:
    """The shaft speed [rpm] at which both of the paper's rig lines add up, and the cage's deviation at it [%]."""

    shaft_rpm: float
    cage_pct: float


@dataclass(frozen=True, kw_only=True)
class PublishedSpeedRow:
    """Mean tachometer speed of one state's record at a nominal speed [rpm], and from the outer-race record's [%]."""

    state: Fault
    nominal_rpm: float
    mean_rpm: float
    from_outer_pct: float


def single_speed(printed: Table6, bearing: Bearing) -> SingleSpeed:
    """One speed for both lines of Table 6."""
    rpm, cage_pct = one_speed_reading(printed, bearing)
    return SingleSpeed(shaft_rpm=rpm, cage_pct=cage_pct)


def published_speed_rows() -> tuple[PublishedSpeedRow, ...]:
    """Every published mean, by state and nominal speed."""
    means = {(mean.state, mean.nominal_rpm): mean.mean_rpm for mean in published_speeds().means}
    return tuple(
        PublishedSpeedRow(
            state=state,
            nominal_rpm=rpm,
            mean_rpm=means[state, rpm],
            from_outer_pct=deviation_pct(means[state, rpm], means[Fault.OUTER, rpm]),
        )
        for state, rpm in sorted(means, key=lambda key: (list(Fault).index(key[0]), key[1]))
    )
