"""Stored results of the studies: lists the stale results and computes them again.

Each result, and each row of a study's sweeps, is stored when it is computed, so an interrupted command can continue.
"""

import argparse
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any
from unittest.mock import patch

from srbval.check import fingerprint
from srbval.errors import ConfigurationError
from srbval.progress import Progress, prefix_tasks, silent
from srbval.recordings.manifest import HOME_VARIABLE
from srbval.recordings.registry import RECORDINGS_VARIABLE
from srbval.storage.installation import git_revision, is_source_tree, shipped_folder
from srbval.storage.stored_result import REPORTS, Fingerprint, ResultKind, StoredResult, newest_result, read_result
from srbval.studies.harness import load_study, make_result, study_names

State = dict[str, Any]  # keys: name, kind, fresh, why, made_utc, machine, minutes


def result_states(now: Fingerprint) -> list[State]:
    """State of every stored result: fresh, or stale if it does not agree with the program's fingerprint `now`."""
    names, studies = {path.stem for path in shipped_folder(REPORTS).glob("*.json")}, study_names()
    results = {name: newest_result(name) for name in sorted(names.union(studies))}
    return [_describe(name, result, now) for name, result in results.items() if result or name in studies]


def _describe(name: str, result: StoredResult | None, now: Fingerprint) -> State:
    """State of the study `name` and its `result` (None if missing): kind, `fresh` or `why` not, date, machine, time."""
    kind = load_study(name).kind if result is None else result.kind
    why = "it was never computed" if result is None else result.why_stale(now)
    origin: Mapping[str, Any] = {} if result is None else result.origin
    state = {"name": name, "kind": kind, "fresh": why is None, "why": why, "made_utc": origin.get("made_utc")}
    return state | {"machine": origin.get("processor"), "minutes": origin.get("minutes")}


def recompute(
    names: Sequence[str] = (),
    *,
    every: bool = False,
    jobs: int | None = None,
    progress: Progress = silent,
    message: Callable[[str], None] = lambda _: None,
    command: str = "srbval evidence",
) -> Iterator[State]:
    """Compute stale results of the studies `names` (default: all) again, or `every` result; yields the state of each.

    Only results are computed that need no recordings from outside the program. In a source tree they are written to
    ``reports``, otherwise to the user's cache. `message` receives a line with the expected duration before each study.
    Raises `ConfigurationError` for an unknown study, or a study that needs recordings from outside.
    """
    studies = [load_study(name) for name in names or study_names()]
    recorded = [study.name for study in studies if study.kind is not ResultKind.EVIDENCE]
    if names and recorded:
        raise ConfigurationError(
            f"study {recorded[0]} needs recordings that are not part of srbval, so it is not computed here. Register "
            f"them with `srbval data add DIR`, then run `srbval study run {recorded[0]}`."
        )
    revision, now = git_revision(), fingerprint(jobs=jobs, progress=progress)
    states = [(one, _describe(one.name, newest_result(one.name), now)) for one in studies if one.name not in recorded]
    wanted = [(study, state) for study, state in states if every or not state["fresh"]]
    yield from (state for _, state in states if state["fresh"] and not every)
    if wanted:
        minutes = sum(state["minutes"] or 0.0 for _, state in wanted)
        message(f"{len(wanted)} results to compute; the stored ones took {minutes:.0f} minutes in all")
    for study, state in wanted:
        before = f"; it took {state['minutes']:.0f} minutes on {state['machine']}" if state["minutes"] else ""
        message(f"{study.name}: {state['why'] or 'fresh'}{before}")
        output = shipped_folder(REPORTS) / f"{study.name}.json" if is_source_tree() else None
        options = argparse.Namespace(**study.defaults(), jobs=jobs, output=output)
        origin: dict[str, Any] = {"command": command, "revision": revision, "behaviour": now}
        # The user's recordings are hidden: evidence is based on bundled recordings alone.
        with (
            tempfile.TemporaryDirectory(prefix="srbval-") as home,
            patch.dict(os.environ, {HOME_VARIABLE: home, RECORDINGS_VARIABLE: ""}),
        ):
            _, stored = make_result(study.name, options, prefix_tasks(progress, study.name), **origin)
        message(f"{study.name}: stored after {stored['minutes']:.1f} minutes")
        yield _describe(study.name, read_result(stored["file"]), now)
