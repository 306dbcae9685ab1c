"""The results in README.md, from a report: ``python -m tests.readme_table srbval-report/report.json``.

They are written between `BEGIN` and `END`; a test compares them with a fresh report.
"""

import argparse
import json
from pathlib import Path
from typing import Any

README = Path(__file__).parents[1] / "README.md"
BEGIN, END = "<!-- results: python -m tests.readme_table -->\n", "<!-- end of results -->\n"


def readme_table(report: dict[str, Any]) -> str:
    """Table 6 with its sources, values and deviations, and the answer, from the content of ``report.json``."""
    table = next(one for one in report["tables"] if one["id"] == "table-6-sources")
    lines = ["| | outer race, BPFO | inner race, BPFI |", "| --- | --- | --- |"]
    for row in table["rows"]:
        lines.append(f"| {row['source']}, {row['source_note']} | {_cell(row, 'outer')} | {_cell(row, 'inner')} |")
    return "\n".join([*lines, "", *report["headline"]["text"].replace(". ", ".\n").split("\n")]) + "\n"


def _cell(row: dict[str, Any], key: str) -> str:
    half = f" ± {row[f'{key}_ci95']:.2f}" if f"{key}_ci95" in row else ""
    return f"{row[key]:.2f}{half} Hz" + (f" ({row[f'{key}_note']})" if f"{key}_note" in row else "")


def in_readme() -> str:
    """The results in the README."""
    return README.read_text(encoding="utf-8").partition(BEGIN)[2].partition(END)[0]


def main() -> None:
    """Write the results of a report into the README."""
    parser = argparse.ArgumentParser(description="Put a report's results into README.md.")
    parser.add_argument("report", type=Path, help="report.json of srbval report")
    made = readme_table(json.loads(parser.parse_args().report.read_text(encoding="utf-8")))
    before, _, rest = README.read_text(encoding="utf-8").partition(BEGIN)
    README.write_text(before + BEGIN + made + END + rest.partition(END)[2], encoding="utf-8")


if __name__ == "__main__":
    main()
