"""``srbval kinematics``: fault frequencies of a bearing; ``srbval bearing``: the bearings known by name."""

import argparse
import dataclasses
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

    document = dataclasses.asdict(frequencies) | {
        "orders": bearing.orders,
        "bearing": bearing.name,
        "rolling_elements": bearing.rolling_elements,
        "rpm": options.rpm,
        "source": bearing.source,
    }
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

    return answer(options, {"count": len(found), "bearings": [_document(bearing) for bearing in found]}, show)


def _document(bearing: Bearing) -> dict[str, object]:
    names = ("name", "title", "source", "rolling_elements", "orders", "elements", "geometry")
    return {name: getattr(bearing, name) for name in names} | {"models": models_of(bearing)}


def _row(bearing: Bearing) -> tuple[object, ...]:
    d, pitch, angle = None, None, None
    if (geometry := bearing.geometry) is not None:
        d, pitch, angle = geometry.roller_diameter_m, 2 * geometry.pitch_radius_m, geometry.tilt_rad
    elif (elements := bearing.elements) is not None:
        d, pitch, angle = elements.element_diameter_m, elements.pitch_diameter_m, elements.contact_angle_rad
    return (
        bearing.name,
        bearing.rolling_elements,
        d and d * 1e3,
        pitch and pitch * 1e3,
        None if angle is None else math.degrees(angle),
        *(getattr(bearing.orders, name) for name in LINES),
        models_of(bearing)[-1],
        bearing.title,
    )
