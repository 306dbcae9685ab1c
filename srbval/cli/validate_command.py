"""``srbval validate``: simulated against measured signals of any model and any rig."""

import argparse
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from srbval.cli.output import answer, own_command
from srbval.errors import ConfigurationError
from srbval.progress import ProgressDisplay, stage
from srbval.progress.tables import text_rows

FOLDER = "srbval-validation"
OUT_OF_TOLERANCE, INCOMPLETE, RUN_FAILED = 1, 3, 4  # exit codes
SHOWN = ("pair", "quantity", "unit", "kinematic", "simulated", "measured", "error", "uncertainty", "verdict")


def run(options: argparse.Namespace) -> int:
    """Compare, write the report, print the table; exit code 1 if a tolerance is missed, 3 if a pair failed, 4 a run."""
    with ProgressDisplay() as progress:
        with stage(progress, "Load the program"):
            from srbval.report.reports import report_case
            from srbval.validation.case import load_case, write_case
        changes = dict(_changes(options))
        if options.case is not None:
            if options.simulated or options.measured:
                raise ConfigurationError("give a case, or --simulated and --measured files, not both.")
            case = load_case(options.case, changes)
        else:
            case = _case_of_files(options, changes)
        if options.write_case:
            write_case(case, Path(options.write_case))
        formats = ("html", "json") if options.no_pdf else ("html", "pdf", "json")
        folder = Path(options.output or f"{FOLDER}{'-' + Path(options.case).stem if options.case else ''}")
        result, files = report_case(case, folder, formats=formats, command=own_command(), progress=progress)
    report = {kind: str(path) for kind, path in files.items()}
    problems = [(number, text) for number, text in result.pairs[["pair", "problem"]].itertuples(index=False) if text]
    code = INCOMPLETE if result.failed else RUN_FAILED if problems else 0 if result.holds else OUT_OF_TOLERANCE

    def show() -> None:
        print(result.headline)
        print(text_rows(result.table[list(SHOWN)].to_dict("records")))
        for number, text in problems:
            print(f"pair {number}: {text}")
        for one in result.failed:
            print(f"pair {one['pair']} failed: {one['reason']}")
        print("\n".join(report.values()))

    document = result.to_dict() | {"report": report}
    return answer(options, document, show, code=code, tables={"table": document["table"]})


def _changes(options: argparse.Namespace) -> Iterator[tuple[str, Any]]:
    """Values that replace those of the case, by dotted key."""
    short = (one for one in vars(options).items() if one[0] == "bearing" or "." in one[0])  # named as keys of a case
    yield from ((key, value) for key, value in short if value is not None)
    for text in options.set or ():
        key, mark, value = text.partition("=")
        if not mark:
            raise ConfigurationError(f"--set {text!r}: write KEY=VALUE, such as measured.channel=DE.")
        yield key.strip(), _value(value.strip())


def _value(text: str) -> Any:
    """A value as TOML has it; any other text is a text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _case_of_files(options: argparse.Namespace, changes: dict[str, Any]) -> Any:
    from srbval.bearing import Fault
    from srbval.validation.case import case_of_pairs
    from srbval.validation.sides import pair_files

    if options.model and options.measured and not options.simulated:
        side = {"scene": options.scene or "paper", "model": options.model}
        return case_of_pairs([{"measured": file, "simulated": side} for file in options.measured], changes)
    if not (options.simulated and options.measured):
        raise ConfigurationError(
            "name a case (a TOML file, or one of data_manifest/cases), or files with --simulated and --measured."
        )
    # A first case, of one pair that stands for all, checks and holds the settings of both sides.
    given = case_of_pairs([{"simulated": options.simulated, "measured": options.measured}], changes)
    state = Fault(options.state) if options.state else None
    settings = {"simulated": given.simulated, "measured": given.measured}
    return case_of_pairs(pair_files(options.simulated, options.measured, settings, state), changes)
