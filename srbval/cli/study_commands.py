"""Commands ``srbval check``, ``evidence``, ``study``, ``bench`` and ``stability``."""

import argparse
import math
import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from srbval.check import fingerprint, reference_path, run_check, write_reference
from srbval.cli.output import own_command, print_result
from srbval.progress import Progress, ProgressDisplay, prefix_tasks, stage
from srbval.progress.tables import text_rows, text_table
from srbval.report.figures.style import Panel
from srbval.storage.files import check_suffix
from srbval.storage.json_files import to_json, write_json
from srbval.storage.stored_result import ResultKind, newest_result, reference_fingerprint
from srbval.studies.bench import bench, draw_study, stability
from srbval.studies.evidence import State, recompute, result_states
from srbval.studies.harness import StudyResult, load_study, make_result, study_names
from srbval.studies.scale import measure_scale

MAX_PRINTED_QUANTITIES = 20  # quantities out of tolerance that are printed; --json contains all
VALIDITY_BY_KIND = {ResultKind.RECORDED: "as recorded", ResultKind.DOCUMENT: "of its revision"}
MULTIPLE = ("scenes", "solvers", "rpm")  # options of studies that take several values


def run_check_command(options: argparse.Namespace) -> int:
    """Compare key results of srbval with a stored reference, or update it; exit code 1 if any differ or are stale."""
    with ProgressDisplay() as progress:
        now = fingerprint(progress=prefix_tasks(progress, "Check"))
    document = run_check(now)
    changed = [one for one in document["checks"] if not one["ok"]]
    if options.update:
        replaced = bool(changed) and options.yes
        if replaced:
            write_reference(now)
        left = "replaced" if replaced else "unchanged; --yes replaces it"
        text = f"{reference_path()}: {left if changed else 'nothing differs'}; {len(changed)} quantities differ"
        document |= {"reference": reference_path(), "replaced": replaced, "differences": changed}
        return print_result(options, document, text, code=0 if replaced or not changed else 1)
    status, code = "drifted" if changed else "stale" if document["stale"] else "ok", 0 if document["ok"] else 1
    return print_result(options, document, lambda: _show_check(document, changed), status=status, code=code)


def _show_check(result: Mapping[str, Any], wrong: Sequence[Mapping[str, Any]]) -> None:
    sizes, off = (Counter(one["name"].partition(":")[0] for one in some) for some in (result["checks"], wrong))
    rows = [(part, size, off[part]) for part, size in sizes.items()]
    print(text_table(("part of the program", "quantities", "out of tolerance"), rows))
    for one in wrong[:MAX_PRINTED_QUANTITIES]:
        name, value = one["name"], "no value" if math.isnan(one["value"]) else f"{one['value']:.9g}"
        if one["words"]:
            print(f"{name}: {one['words'][1]}, the reference is {one['words'][0]}")
        elif math.isnan(one["low"]):
            print(f"{name}: {value}, the reference has no value")
        else:
            print(f"{name}: {value} is not within {one['low']:.9g} to {one['high']:.9g}")
    if len(wrong) > MAX_PRINTED_QUANTITIES:
        print(f"and {len(wrong) - MAX_PRINTED_QUANTITIES} more; --json lists all")
    for stale in result["stale"]:
        file, why = stale["file"], stale["why"]
        print(f"stale: reports/{file}: {why}. Compute it again: srbval evidence {file.removesuffix('.json')}")
    if result["ok"]:
        print("Every quantity is within its tolerance, and no stored evidence is stale.")


def run_evidence_command(options: argparse.Namespace) -> int:
    """List or recompute the stored results of studies; exit code 1 if one is outdated."""
    with ProgressDisplay() as progress:
        if options.list:
            known = result_states(fingerprint(progress=progress))
            states = [one for one in known if not options.names or one["name"] in options.names]
        else:
            how = {"jobs": options.jobs, "message": progress.message, "command": own_command()}
            states = list(recompute(options.names, every=options.all, progress=progress, **how))
    stale = [one for one in states if one["kind"] is ResultKind.EVIDENCE and not one["fresh"]]
    status, code = ("stale", 1) if stale else ("ok", 0)
    return print_result(options, {"results": to_json(states)}, lambda: _show_results(states), status=status, code=code)


def _show_results(states: Sequence[State]) -> None:
    rows = []
    for one in states:
        holds = VALIDITY_BY_KIND.get(one["kind"]) or ("yes" if one["fresh"] else "no")
        rows.append({**one, "kind": one["kind"].value, "holds": holds})
    shown = {name: name for name in ("kind", "holds", "minutes", "machine")}
    print(text_rows(rows, {"result": "name", **shown, "computed": "made_utc", "reason": "why"}))
    minutes = [one["minutes"] for one in states if one["minutes"] is not None and one["kind"] is ResultKind.EVIDENCE]
    if minutes:
        print(f"evidence took {sum(minutes):.1f} minutes in all")


def run_study_command(options: argparse.Namespace) -> int:
    """List the studies or run one, such as ``bench`` or ``stability``."""
    if hasattr(options, "study"):
        return _run_study(options)
    states = {state["name"]: state for state in result_states(reference_fingerprint())}
    rows = []
    for one, state in ((load_study(name), states[name]) for name in study_names()):
        about: dict[str, object] = {"name": state["name"], "question": one.question, "kind": one.kind.value}
        rows.append(about | {"minutes": state["minutes"], "made_utc": state["made_utc"], "stale": state["why"]})
    shown = {name: name for name in ("question", "kind", "minutes", "stale")}
    return print_result(options, {"studies": rows}, text_rows(rows, {"study": "name", **shown, "stored": "made_utc"}))


def _run_study(options: argparse.Namespace) -> int:
    name, command = options.study, options.action if options.command == "study" else options.command
    plot = Path(getattr(options, "plot", None) or f"srbval-{command}.svg")
    check_suffix(plot, "SVG", (".svg",))
    for key in MULTIPLE:
        if given := getattr(options, key, None):
            setattr(options, key, list(dict.fromkeys(given)))  # each value once
    with ProgressDisplay() as shown:
        progress = prefix_tasks(shown, name.replace("_", " ").capitalize())
        scale = getattr(options, "scale", False)
        if scale or getattr(options, "model", None) or getattr(options, "quick", False):
            found, stored = _run_variant(name, options, progress, shown.message)
        else:
            origin = getattr(newest_result(name), "origin", {"minutes": None})
            took = origin["minutes"] and f"the stored result took {origin['minutes']:.0f} minutes; "
            shown.message(f"{took or ''}compiling takes half a minute once")
            found, stored = make_result(name, options, progress, command=own_command())
        if hasattr(options, "plot") and not scale:
            with stage(progress, "Draw"):
                Panel(draw_study, name, stored)(plot.parent, plot.stem)
            stored |= {"plot": plot}
    if "file" in stored:
        print(f"stored: {stored['file']}", file=sys.stderr)
    text = f"{found.text}\n\nDrawn in {plot}" if "plot" in stored else found.text
    return print_result(options, stored, text)


def _run_variant(
    name: str, given: argparse.Namespace, progress: Progress, message: Callable[[str], None]
) -> tuple[StudyResult, dict[str, Any]]:
    """Run ``bench`` or ``stability`` with --quick, --model or --scale; only --output stores such a result."""
    given_lists = {key: tuple(own) for key in MULTIPLE if (own := getattr(given, key, None))}
    asked: dict[str, Any] = given_lists | {"quick": given.quick, "progress": progress}
    if getattr(given, "scale", False):
        found = measure_scale(quick=given.quick, progress=progress)
    elif name == "speed_accuracy":
        found = bench(given.model, message=message, **asked)
    else:
        found = stability(given.model, jobs=given.jobs, **asked)
    content = to_json(found.content) | ({"model": given.model} if given.model else {})
    if given.output:
        write_json(Path(given.output), content)
    return found, content
