"""``srbval bearing``: the bearings known by name."""

import argparse
import dataclasses
import math

from srbval.bearing import Bearing, find_bearings
from srbval.cli.output import print_json, print_table
from srbval.models.hierarchy import models_of


def run(options: argparse.Namespace) -> int:
    """List the bearings that hold every word of the search; an empty list is an answer."""
    found = find_bearings(options.search or "")
    if options.json:
        print_json({"count": len(found), "bearings": [_document(bearing) for bearing in found]})
        return 0
    print_table(("name", "Z", "d mm", "D mm", "angle deg", "BPFO", "BPFI", "BSF", "FTF", "models up to", "title"),
                [_row(bearing) for bearing in found])  # fmt: skip
    print(f"\n{len(found)} bearings; --json has the source of each. Your own is a TOML file: --bearing mine.toml")
    return 0


def _document(bearing: Bearing) -> dict[str, object]:
    return {
        "name": bearing.name, "title": bearing.title, "source": bearing.source,
        "rolling_elements": bearing.rolling_elements, "orders": dataclasses.asdict(bearing.orders),
        "elements": bearing.elements and dataclasses.asdict(bearing.elements),
        "geometry": bearing.geometry and dataclasses.asdict(bearing.geometry),
        "models": models_of(bearing),
    }  # fmt: skip


def _row(bearing: Bearing) -> tuple[object, ...]:
    geometry, elements, orders = bearing.geometry, bearing.elements, bearing.orders
    sizes: tuple[float | None, float | None, float | None] = (None, None, None)
    if geometry is not None:
        sizes = (geometry.roller_diameter_m, 2 * geometry.pitch_radius_m, geometry.tilt_rad)
    elif elements is not None:
        sizes = (elements.element_diameter_m, elements.pitch_diameter_m, elements.contact_angle_rad)
    d, pitch, angle = sizes
    return (
        bearing.name, bearing.rolling_elements, d and d * 1e3, pitch and pitch * 1e3,
        None if angle is None else math.degrees(angle), orders.bpfo, orders.bpfi, orders.bsf, orders.ftf,
        models_of(bearing)[-1], bearing.title,
    )  # fmt: skip
