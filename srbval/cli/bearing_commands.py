"""``srbval kinematics``: fault frequencies of a bearing; ``srbval bearing``: the bearings known by name."""

import argparse
import math
from collections import Counter

from srbval.bearing import DEFAULT_BEARING, Bearing, fault_frequencies, find_bearings, load_bearing
from srbval.cli.output import answer, print_table
from srbval.models.hierarchy import models_of

LINES = ("bpfo", "bpfi", "bsf", "ftf")
COLUMNS = ("name", "Z", "d mm", "D mm", "angle deg", *map(str.upper, LINES), "models up to", "title")


def kinematics(options: argparse.Namespace) -> int:
    """Print the kinematic frequencies and orders."""
    bearing = load_bearing(options.bearing or DEFAULT_BEARING)
    frequencies = fault_frequencies(bearing, rpm=options.rpm)

    def show() -> None:
        print(f"{bearing.title} at {options.rpm:g} rpm, outer ring at rest, no slip\n")
        rows = [(n.upper(), getattr(frequencies, f"{n}_hz"), getattr(bearing.orders, n)) for n in LINES]
        print_table(("line", "Hz", "order"), [("shaft", frequencies.shaft_hz, 1.0), *rows])

    document = vars(frequencies) | {"orders": bearing.orders, "bearing": bearing.name}
    document |= {"rolling_elements": bearing.rolling_elements, "rpm": options.rpm, "source": bearing.source}
    return answer(options, document, show)


def known(options: argparse.Namespace) -> int:
    """List the bearings that match every word of the search; an empty list is an answer."""
    found = find_bearings(options.search or "")

    def show() -> None:
        if options.search is None:
            kinds = [one.title.split(" (")[0].partition(", ")[2] for one in found]
            rows = [(kind, count, found[kinds.index(kind)].name) for kind, count in Counter(kinds).most_common()]
            print_table(("kind", "bearings", "for example"), rows)
            print(f"\n{len(found)} bearings; list them with --search WORDS, for example --search 222")
            return
        print_table(COLUMNS, [_row(bearing) for bearing in found])
        print(f"\n{len(found)} bearings; --json has the source of each. Your own: --elements, --orders or a TOML file")

    names = ("name", "title", "source", "rolling_elements", "orders", "elements", "geometry")
    bearings = [{name: getattr(one, name) for name in names} | {"models": models_of(one)} for one in found]
    return answer(options, {"count": len(found), "bearings": bearings}, show)


def _row(bearing: Bearing) -> tuple[object, ...]:
    sizes: tuple[float | None, ...] = (None, None, None)
    if (geometry := bearing.geometry) is not None:
        sizes = geometry.roller_diameter_m * 1e3, 2e3 * geometry.pitch_radius_m, math.degrees(geometry.tilt_rad)
    elif (own := bearing.elements) is not None:
        sizes = own.element_diameter_m * 1e3, own.pitch_diameter_m * 1e3, math.degrees(own.contact_angle_rad)
    orders = (getattr(bearing.orders, name) for name in LINES)
    return (bearing.name, bearing.rolling_elements, *sizes, *orders, models_of(bearing)[-1], bearing.title)
