"""The table of results in README.md, from a report: ``python -m tests.readme_table srbval-report/report.json``.

The table is written between `BEGIN` and `END`; a test compares it with a fresh report.
"""

import argparse
import json
from pathlib import Path
from typing import Any

from srbval.comparison.comparison import TOLERANCE

README = Path(__file__).parents[1] / "README.md"
BEGIN, END = "<!-- results: python -m tests.readme_table -->\n", "<!-- end of results -->\n"


def readme_table(report: dict[str, Any]) -> str:
    """Render the table from the content of ``report.json``."""
    races = ("outer", "inner")
    by_source = {"published": {}, "measured": {}}
    for row in report["table6"]:
        by_source[row["rig_source"]][row["defect"]] = row
    printed = [by_source["published"][race] for race in races]
    measured = [by_source["measured"][race] for race in races]
    rows = [
        ("kinematic, printed, 710 rpm", [f"{row['kinematic_hz']:.2f} Hz" for row in printed]),
        ("the paper's model / rig", [f"{row['paper_model_hz']:.2f} / {row['paper_rig_hz']:.2f} Hz" for row in printed]),
        ("this model, by its cage", [_cage(row) for row in printed]),
        (
            "the rig's record at 877 rpm nominal, tachometer speed",
            [f"order {60 * row['rig_hz'] / row['shaft_rpm']:.3f}" for row in measured],
        ),
    ]
    stated = report["verdicts"]
    scenes = list(dict.fromkeys(one["scene"] for one in stated))
    endpoints = list(dict.fromkeys(one["endpoint"] for one in stated))
    errors = {(one["endpoint"], one["scene"]): _error(one) for one in stated}
    verdicts = [(f"cage ratio, {endpoint}", [errors[endpoint, scene] for scene in scenes]) for endpoint in endpoints]
    limit = f"model less rig: within {TOLERANCE.limit_pct:g} %?"
    lines = [
        "| | outer race, BPFO | inner race, BPFI |",
        "| --- | --- | --- |",
        *_lines(rows),
        "",
        f"| {limit} | the paper's scene | the rig's own scene |",
        "| --- | --- | --- |",
        *_lines(verdicts),
    ]
    return "\n".join(lines) + "\n"


def _cage(row: dict[str, Any]) -> str:
    return f"{row['model_cage_hz']:.2f} Hz ({100 * (row['model_cage_hz'] / row['kinematic_hz'] - 1):+.2f} %)"


def _lines(rows: list[tuple[str, list[str]]]) -> list[str]:
    return [f"| {name} | {first} | {second} |" for name, (first, second) in rows]


def _error(one: dict[str, Any]) -> str:
    return f"{round(one['error_pct'], 2) + 0.0:+.2f} ± {one['u_pct']:.2f} %: {one['verdict']}"


def in_readme() -> str:
    """The table in the README."""
    return README.read_text(encoding="utf-8").partition(BEGIN)[2].partition(END)[0]


def main() -> None:
    """Write the table of a report into the README."""
    parser = argparse.ArgumentParser(description="Put a report's results into README.md.")
    parser.add_argument("report", type=Path, help="report.json of srbval report")
    made = readme_table(json.loads(parser.parse_args().report.read_text(encoding="utf-8")))
    before, _, rest = README.read_text(encoding="utf-8").partition(BEGIN)
    README.write_text(before + BEGIN + made + END + rest.partition(END)[2], encoding="utf-8")


if __name__ == "__main__":
    main()
