"""``srbval study``: list and run the studies; ``bench`` and ``stability`` are two of them."""

import argparse

from srbval.cli.arguments import Parser
from srbval.cli.output import answer, own_command
from srbval.errors import ConfigurationError
from srbval.progress import prefixed, progress_display
from srbval.progress.tables import text_rows
from srbval.storage.behaviour import reference_fingerprint
from srbval.storage.content_store import stored_results
from srbval.studies.evidence import result_states
from srbval.studies.harness import load_study, make_result, study_names

UNSOUND = 1
VERBS = {"bench": "speed_accuracy", "stability": "stability"}


def run(options: argparse.Namespace) -> int:
    """Do what is asked; exit code 1 if what a study tests does not hold."""
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
    given = parser.parse_args(options.rest, argparse.Namespace(json=options.json, export=options.export))
    with progress_display() as progress, stored_results(fresh=given.fresh):
        found, stored = make_result(
            name, given, prefixed(progress, name.replace("_", " ").capitalize()), command=own_command()
        )
    return answer(given, stored, found.text, code=0 if found.sound else UNSOUND)


def _list(options: argparse.Namespace) -> int:
    states = {state.name: state for state in result_states(reference_fingerprint())}
    rows = []
    for name in study_names():
        study, state = load_study(name), states[name]
        asked: dict[str, str | float | None] = {
            "name": name,
            "question": study.question,
            "kind": study.kind.value,
            "minutes": study.minutes,
        }
        asked |= {"made_utc": state.made_utc, "stale": state.why}
        rows.append(asked)
    shown = {one: one for one in ("question", "kind", "minutes", "stale")}
    return answer(options, {"studies": rows}, text_rows(rows, {"study": "name", **shown, "stored": "made_utc"}))
