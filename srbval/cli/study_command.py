"""``srbval study``: list and run the studies; ``bench`` and ``stability`` are two of them."""

import argparse
from typing import Any

from srbval.cli.arguments import Parser
from srbval.cli.output import answer, own_command
from srbval.errors import ConfigurationError
from srbval.progress import prefixed, progress_display
from srbval.progress.tables import text_rows
from srbval.storage.content_store import stored_results
from srbval.storage.stored_result import newest_result
from srbval.studies.harness import load_study, make_result, pages, study_names

UNSOUND = 1
MORE = "Every row: --all, --export FILE, --json"
VERBS = {"bench": "speed_accuracy", "stability": "stability"}


def run(options: argparse.Namespace) -> int:
    """Do what is asked; exit code 1 where a study finds that what it tests does not hold."""
    if options.command in VERBS:
        return _run(VERBS[options.command], f"srbval {options.command}", options)
    if options.action == "run":
        if options.name is None:
            raise ConfigurationError("name a study, for example: srbval study run naming. See: srbval study list")
        return _run(options.name, f"srbval study run {options.name}", options)
    return _list(options)


def _run(name: str, command: str, options: argparse.Namespace) -> int:
    study = load_study(name)
    parser = Parser(prog=command, description=study.question)
    study.add_options(parser)
    parser.add_argument("--jobs", metavar="N", type="jobs", help="runs at a time (default: one per core)")
    told = "store it here (default: a complete result is stored for the report)"
    parser.add_argument("-o", "--output", metavar="FILE", help=told)
    parser.add_argument("--fresh", action="store_true", help="compute what the cache holds again")
    parser.add_argument("--json", action="store_true", help="print one JSON document")
    parser.add_argument("--all", action="store_true", help="print every row before the answer")
    given = parser.parse_args(options.rest, argparse.Namespace(json=options.json, export=options.export))
    with progress_display() as progress, stored_results(fresh=given.fresh):
        found, stored = make_result(
            name, given, prefixed(progress, name.replace("_", " ").capitalize()), command=own_command()
        )
    text = f"{found.text}\n{MORE}" if found.tables else found.text
    if found.tables and given.all:
        text = f"{found.tables}\n\n{found.text}"
    return answer(given, stored, text, code=0 if found.sound else UNSOUND)


def _list(options: argparse.Namespace) -> int:
    of_page = {page.name: page for page in pages()}
    rows = [_about(name, of_page[name].results if name in of_page else (name,)) for name in study_names()]
    shown = {"study": "name", "question": "question", "minutes": "minutes", "stored": "made_utc", "stale": "stale"}
    return answer(options, {"studies": rows}, text_rows(rows, shown))


def _about(name: str, results: tuple[str, ...]) -> dict[str, Any]:
    study, result = load_study(name), newest_result(results[0]) if results else None
    return {
        "name": name, "question": study.question, "minutes": study.minutes, "results": results,
        "made_utc": result and result.made_utc, "stale": result and result.stale,
    }  # fmt: skip
