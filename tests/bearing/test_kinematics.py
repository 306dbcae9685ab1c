import math

import pytest

from srbval.bearing import FaultOrders, load_bearing
from srbval.comparison.table6 import table6
from srbval.errors import ConfigurationError

PRINTED_HZ = 0.05  # the printed kinematic frequencies follow from slightly rounded geometry
PUBLISHED_ORDER = 3e-4  # published with four decimals, from diameters rounded to a tenth of a thousandth of an inch


def test_paper_frequencies_follow_from_table_1() -> None:
    printed = table6()
    at = load_bearing("skf-22240").orders.at(printed.shaft_rpm / 60)
    assert at.bpfo_hz == pytest.approx(printed.of("outer").kinematic_hz, abs=PRINTED_HZ)
    assert at.bpfi_hz == pytest.approx(printed.of("inner").kinematic_hz, abs=PRINTED_HZ)


@pytest.mark.parametrize(
    ("name", "bpfi", "bpfo", "twice_bsf", "ftf"),
    [  # Case Western Reserve University's table of fault frequencies; MFPT's description
        ("skf-6205", 5.4152, 3.5848, 4.7135, 0.39828),
        ("skf-6203", 4.9469, 3.0530, 3.9874, 0.3817),
        ("mfpt-nice", 4.755, 3.245, 5.1091, 0.4056),
        ("fag-22205", 8.8148, 6.1852, 5.4030, 0.4123),
        ("mafaulda-ball", 5.002, 2.998, 2 * 1.871, 0.375),  # with three decimals, beside its dimensions
    ],
)
def test_known_bearings_have_their_published_orders(
    name: str, bpfi: float, bpfo: float, twice_bsf: float, ftf: float
) -> None:
    orders, rounded = load_bearing(name).orders, 4 if name == "mafaulda-ball" else 1
    found = (orders.bpfi, orders.bpfo, 2 * orders.bsf, orders.ftf)
    assert found == pytest.approx((bpfi, bpfo, twice_bsf, ftf), abs=rounded * PUBLISHED_ORDER)


def test_ims_bearing_has_the_frequencies_printed_with_its_dimensions() -> None:
    at = load_bearing("rexnord-za-2115").orders.at(2000 / 60)  # Qiu et al. 2006 print the first
    assert (at.bpfo_hz, at.bpfi_hz, at.bsf_hz, at.ftf_hz) == pytest.approx((236.4, 296.9, 139.9, 14.8), abs=PRINTED_HZ)


@pytest.mark.parametrize("diameter", [0.0, -0.01, 0.05, math.nan])
def test_impossible_dimensions_are_refused(diameter: float) -> None:
    with pytest.raises(ConfigurationError):
        FaultOrders.from_dimensions(
            rolling_elements=10, element_diameter_m=diameter, pitch_diameter_m=0.05, contact_angle_rad=0.0
        )
