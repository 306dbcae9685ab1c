"""The table of results in README.md, from a report: ``python -m tests.readme_table srbval-report/report.json``.

It goes between `BEGIN` and `END`, and a test holds what stands there to a fresh report.
"""

import argparse
import json
from pathlib import Path
from typing import Any

from srbval.comparison.budget import STATED, TOLERANCE

README = Path(__file__).parents[1] / "README.md"
BEGIN, END = "<!-- results: python -m tests.readme_table -->\n", "<!-- end of results -->\n"


def readme_table(report: dict[str, Any]) -> str:
    """The table, from the content of ``report.json``: the outer race, the inner race."""
    printed = {row["defect"]: row for row in report["table6"] if row["rig_source"] == "published"}
    measured = {row["defect"]: row for row in report["table6"] if row["rig_source"] == "measured"}
    races = ("outer", "inner")
    rows = [
        ("kinematic, printed, 710 rpm", [f"{printed[race]['kinematic_hz']:.2f} Hz" for race in races]),
        ("the paper's model / rig", [
            f"{printed[race]['paper_model_hz']:.2f} / {printed[race]['paper_rig_hz']:.2f} Hz" for race in races
        ]),
        ("this model, by its cage", [
            f"{printed[race]['model_cage_hz']:.2f} Hz "
            f"({100 * (printed[race]['model_cage_hz'] / printed[race]['kinematic_hz'] - 1):+.2f} %)" for race in races
        ]),
        ("the rig's record at 877 rpm nominal, tachometer speed", [
            f"order {60 * measured[race]['rig_hz'] / measured[race]['shaft_rpm']:.3f}" for race in races
        ]),
    ]  # fmt: skip
    stated = [one for one in report["verdicts"] if one["form"] == STATED]
    scenes = {one["scene"]: {} for one in stated}
    for one in stated:
        scenes[one["scene"]][one["endpoint"]] = one
    verdicts = [
        (f"cage ratio, {endpoint}", [_error(own[endpoint]) for own in scenes.values()])
        for endpoint in next(iter(scenes.values()))
    ]
    limit = f"model less rig: within {TOLERANCE.limit_pct:g} %?"
    return "\n".join([
        "| | outer race, BPFO | inner race, BPFI |", "| --- | --- | --- |", *_lines(rows), "",
        f"| {limit} | the paper's scene | the rig's own scene |", "| --- | --- | --- |", *_lines(verdicts),
    ]) + "\n"  # fmt: skip


def _lines(rows: list[tuple[str, list[str]]]) -> list[str]:
    return [f"| {name} | {first} | {second} |" for name, (first, second) in rows]


def _error(one: dict[str, Any]) -> str:
    return f"{round(one['error_pct'], 2) + 0.0:+.2f} ± {one['u_pct']:.2f} %: {one['verdict']}"


def in_readme() -> str:
    """What stands there."""
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
