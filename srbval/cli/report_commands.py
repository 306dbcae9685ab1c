"""Commands ``srbval report`` and ``srbval validate``."""

import argparse
import sys
import time
from pathlib import Path
from typing import Any

from srbval.cli.data_command import recording_settings
from srbval.cli.output import own_command, print_result
from srbval.errors import ConfigurationError, DataError, NumericsError
from srbval.progress import ProgressDisplay, stage
from srbval.progress.tables import text_rows
from srbval.storage.json_files import to_json

MAIN_FOLDER, VALIDATION_FOLDER = "srbval-report", "srbval-validation"
MAX_NAME_LENGTH = 100  # characters of a file's name in the folder name; file systems limit its length
PAIR_COLUMNS = ("pair", "quantity", "unit", "kinematic", "simulated", "measured", "error", "uncertainty", "verdict")


def run_report_command(options: argparse.Namespace) -> int:
    """Write a report on recordings or, without files, on the comparison of the model with the paper and the test rig.

    Prints the file names. Exit code 1 if a tolerance is missed, 3 if some recordings could not be read or analysed.
    """
    first, more = [Path(file).stem[:MAX_NAME_LENGTH] for file in options.files[:1]], len(options.files) - 1
    usual = "-".join([MAIN_FOLDER, *first, *([f"and-{more}-more"] if more > 0 else ())])
    folder = Path(usual if options.output is None else options.output)
    if not options.files and (recording_settings(options) or options.healthy or options.band or options.cage_slip):
        raise ConfigurationError(
            "options for recordings are given, but no recording; name a recording, for example: srbval report FILE.csv"
        )
    started = time.perf_counter()
    with ProgressDisplay() as progress:
        with stage(progress, "Load the program"):
            from srbval.cli.record_commands import request_from_options
            from srbval.report.reports import make_report, report_sources
            from srbval.studies.harness import pages
        how: dict[str, Any] = {"jobs": options.jobs, "formats": tuple(options.formats), "command": own_command()}
        if options.files:
            request = request_from_options(options)
            report, files = report_sources(options.files, folder, request, progress=progress, **how)
            found = to_json(report.data)
        else:
            report, files = make_report(folder, seconds=options.seconds, pages=pages(), progress=progress, **how)
            headline = report.data["headline"] | {"text": report.verdict.kicker}
            found = {"headline": headline, "table6": report.data["table6"]}
    summary = {kind: str(path) for kind, path in files.items()} | {"figures": str(folder / "figures")}
    told = [] if options.files else [found["headline"]["text"]]
    failed = found.get("failed", ())
    code = DataError.exit_code if failed else 0 if options.files or found["headline"]["holds"] else 1
    document = summary | {"wall_s": time.perf_counter() - started} | found
    for one in failed:
        print(f"srbval: not in the report: {one['file']}: {one['reason']}", file=sys.stderr)
    return print_result(options, document, "\n".join([*told, *summary.values()]), code=code)


def run_validate_command(options: argparse.Namespace) -> int:
    """Compare pairs of simulated and measured signals; exit code 1: out of tolerance, 3: pair failed, 4: run failed."""
    with ProgressDisplay() as progress:
        with stage(progress, "Load the program"):
            from srbval.report.reports import report_case
            from srbval.validation.case import load_case, write_case
        # Options with a dot are keys of the case.
        short = {key: value for key, value in vars(options).items() if key == "bearing" or "." in key}
        changes = {key: value for key, value in short.items() if value is not None} | dict(options.set or ())
        if options.case is not None:
            if options.simulated or options.measured:
                raise ConfigurationError("give a case, or --simulated and --measured files, not both.")
            case = load_case(options.case, changes)
        else:
            case = _case_of_files(options, changes)
        if options.write_case:
            write_case(case, Path(options.write_case))
        folder = Path(options.output or f"{VALIDATION_FOLDER}{'-' + Path(options.case).stem if options.case else ''}")
        result, files = report_case(
            case, folder, formats=tuple(options.formats), command=own_command(), progress=progress
        )
    written = {kind: str(path) for kind, path in files.items()}
    problems = [(number, text) for number, text in result.pairs[["pair", "problem"]].itertuples(index=False) if text]
    code = DataError.exit_code if result.failed else NumericsError.exit_code if problems else 0 if result.holds else 1

    def show() -> None:
        print(result.headline)
        print(text_rows(result.table[list(PAIR_COLUMNS)].to_dict("records")))
        for number, text in problems:
            print(f"pair {number}: {text}")
        for one in result.failed:
            print(f"pair {one['pair']} failed: {one['reason']}")
        print("\n".join(written.values()))

    document = result.to_dict() | {"report": written}
    return print_result(options, document, show, code=code, tables={"table": document["table"]})


def _case_of_files(options: argparse.Namespace, changes: dict[str, Any]) -> Any:
    from srbval.bearing import Fault
    from srbval.validation.case import case_of_pairs
    from srbval.validation.sides import pair_files

    if options.model and options.measured and not options.simulated:
        side = {"scene": options.scene or "paper", "model": options.model}
        return case_of_pairs([{"measured": file, "simulated": side} for file in options.measured], changes)
    if not (options.simulated and options.measured):
        raise ConfigurationError(
            "name a case (a TOML file or a shipped case such as torino-22240) or files with --simulated and --measured."
        )
    # A preliminary case with all files in one pair checks the settings of both sides.
    given = case_of_pairs([{"simulated": options.simulated, "measured": options.measured}], changes)
    state = Fault(options.state) if options.state else None
    settings = {"simulated": given.simulated, "measured": given.measured}
    return case_of_pairs(pair_files(options.simulated, options.measured, settings, state), changes)
