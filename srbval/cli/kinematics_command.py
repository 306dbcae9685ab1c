"""``srbval kinematics``: fault frequencies of a bearing at a shaft speed."""

import argparse
import dataclasses

from srbval.bearing import fault_frequencies, load_bearing
from srbval.cli.output import print_json, print_table


def run(options: argparse.Namespace) -> int:
    """Print the kinematic frequencies and orders."""
    bearing = load_bearing(options.bearing)
    frequencies = fault_frequencies(bearing, rpm=options.rpm)
    if options.json:
        print_json(
            dataclasses.asdict(frequencies)
            | {
                "orders": dataclasses.asdict(bearing.orders),
                "bearing": bearing.name,
                "rolling_elements": bearing.rolling_elements,
                "rpm": options.rpm,
                "source": bearing.source,
            }
        )
        return 0
    print(f"{bearing.title} at {options.rpm:g} rpm, outer ring at rest, no slip\n")
    rows = [("shaft", frequencies.shaft_hz, 1.0)]
    rows += [
        (n.upper(), getattr(frequencies, f"{n}_hz"), getattr(bearing.orders, n)) for n in ("bpfo", "bpfi", "bsf", "ftf")
    ]
    print_table(("line", "Hz", "order"), rows)
    return 0
