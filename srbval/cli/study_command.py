"""``srbval study``: list and run the studies; ``bench`` and ``stability`` are two of them."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

from srbval.cli.arguments import Parser
from srbval.cli.output import answer, own_command
from srbval.errors import ConfigurationError
from srbval.progress import Progress, prefixed, progress_display
from srbval.progress.tables import text_rows
from srbval.storage.behaviour import reference_fingerprint
from srbval.storage.content_store import stored_results
from srbval.storage.json_files import to_json, write_json
from srbval.studies.evidence import result_states
from srbval.studies.harness import StudyResult, load_study, make_result, study_names
from srbval.studies.outside import bench, stability

UNSOUND = 1
OUTSIDE: dict[str, dict[str, Any]] = {
    "--model": {"metavar": "M", "help": "a model from outside: FILE.py:NAME, package.module:NAME or FILE.fmu"},
    "--model-command": {"metavar": "TEXT", "type": "command", "help": 'a program: "./mysim {scene_json} {out_csv}"'},
}
OutsideStudy = Callable[[argparse.Namespace, Progress], StudyResult]
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
    if name in VERBS.values():
        for option, settings in OUTSIDE.items():
            parser.add_argument(option, dest="model", **settings)
    parser.add_argument("--jobs", metavar="N", type="jobs", help="runs at a time (default: one per core)")
    told = "store it here (default: a complete result is stored for the report)"
    parser.add_argument("-o", "--output", metavar="FILE", help=told)
    parser.add_argument("--fresh", action="store_true", help="compute what the cache holds again")
    parser.add_argument("--json", action="store_true", help="print one JSON document")
    given = parser.parse_args(options.rest, argparse.Namespace(json=options.json, export=options.export))
    with progress_display() as shown, stored_results(fresh=given.fresh):
        progress = prefixed(shown, name.replace("_", " ").capitalize())
        if getattr(given, "model", None):
            return _run_outside(given, progress, bench if name == VERBS["bench"] else stability)
        found, stored = make_result(name, given, progress, command=own_command())
    return answer(given, stored, found.text, code=0 if found.sound else UNSOUND)


def _run_outside(given: argparse.Namespace, progress: Progress, study: OutsideStudy) -> int:
    """Run a study of a model from outside; its result is stored only in a file that is named for it."""
    found = study(given, progress)
    content = to_json(found.content) | {"model": given.model}
    if given.output:
        write_json(Path(given.output), content)
    return answer(given, content, found.text)


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
