"""Stored results of the studies: which hold, and computing again those that do not.

`recompute` writes each result as soon as it is computed, and the rows of a study's sweeps are stored one by one: an
interrupted command continues with the same words.
"""

import argparse
import contextlib
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from srbval.check.check import fingerprint
from srbval.errors import ConfigurationError
from srbval.progress import Progress, prefixed, silent
from srbval.recordings.manifest import HOME_VARIABLE
from srbval.recordings.registry import RECORDINGS_VARIABLE
from srbval.storage.installation import git_revision, is_source_tree, shipped_folder
from srbval.storage.stored_result import REPORTS, Fingerprint, ResultKind, StoredResult, newest_result, read_result
from srbval.studies.harness import Study, load_study, make_result, study_names

State = dict[str, Any]  # of a result: name, kind, fresh, why, made_utc, machine, minutes, sound


def result_states(now: Fingerprint) -> list[State]:
    """The state of every study's result, and of every other result that comes with the program, by name."""
    names = sorted({*study_names(), *(path.stem for path in shipped_folder(REPORTS).glob("*.json"))})
    return [state for name in names if (state := _state(name, newest_result(name), now))]


def _state(name: str, result: StoredResult | None, now: Fingerprint) -> State:
    """A result's kind, whether it is `fresh` and else `why` not, its origin; `sound` as its study says.

    `minutes` is the wall time of its computation, None if it was never computed or does not state it. Empty for a
    result that neither exists nor belongs to a study.
    """
    unknown = {"made_utc": None, "machine": None, "minutes": None, "sound": True}
    if result is None:
        kind = {"kind": load_study(name).kind} if name in study_names() else {}
        return kind and {"name": name, **kind, "fresh": False, "why": "it was never computed", **unknown}
    why, origin = result.why_stale(now), result.origin
    known = {"made_utc": result.made_utc, "machine": origin["processor"], "minutes": origin["minutes"]}
    return {"name": name, "kind": result.kind, "fresh": why is None, "why": why, **unknown, **known}


@contextlib.contextmanager
def without_own_recordings() -> Iterator[None]:
    """Within, nobody's recordings are registered: evidence rests on what comes with the program."""
    before = {name: os.environ.pop(name, None) for name in (HOME_VARIABLE, RECORDINGS_VARIABLE)}
    with tempfile.TemporaryDirectory(prefix="srbval-") as home:
        os.environ[HOME_VARIABLE] = home
        try:
            yield
        finally:
            del os.environ[HOME_VARIABLE]
            os.environ.update({name: value for name, value in before.items() if value is not None})


def recompute(
    names: Sequence[str] = (),
    *,
    every: bool = False,
    jobs: int | None = None,
    progress: Progress = silent,
    message: Callable[[str], None] = lambda _: None,
    command: str = "srbval evidence",
) -> Iterator[State]:
    """Compute the evidence that is stale, of the studies `names` (all), or `every` result whether stale or not.

    In a source tree results are written to ``reports``, else to the user's cache. `message` gets a line before each
    study with its expected duration. Yields the state of each study's result. Raises `ConfigurationError` for a name
    that is no study, or whose result rests on recordings that do not come with the program.
    """
    studies = [load_study(name) for name in names or study_names()]
    recorded = [study.name for study in studies if study.kind is not ResultKind.EVIDENCE]
    if names and recorded:
        raise ConfigurationError(
            f"{recorded[0]} rests on recordings that do not come with srbval; if they are registered: "
            f"srbval study run {recorded[0]}"
        )
    revision, now = git_revision(), fingerprint(jobs=jobs, progress=progress)
    wanted, kept = list[tuple[Study, State]](), list[tuple[Study, State]]()
    for study in (one for one in studies if one.kind is ResultKind.EVIDENCE):
        state = _state(study.name, newest_result(study.name), now)
        (wanted if every or not state["fresh"] else kept).append((study, state))
    yield from (state for _, state in kept)
    minutes = sum(study.minutes for study, _ in wanted)
    if wanted:
        message(f"{len(wanted)} results to compute, about {minutes:.0f} minutes on two cores")
    for study, state in wanted:
        message(f"{study.name}: {state['why'] or 'fresh'}; about {study.minutes:g} minutes on two cores")
        started = time.perf_counter()
        output = shipped_folder(REPORTS) / f"{study.name}.json" if is_source_tree() else None
        options = argparse.Namespace(**study.defaults(), jobs=jobs, output=output)
        origin: dict[str, Any] = {"command": command, "revision": revision, "behaviour": now}
        with without_own_recordings():
            found, stored = make_result(study.name, options, prefixed(progress, study.name), **origin)
        message(f"{study.name}: stored after {(time.perf_counter() - started) / 60:.1f} minutes")
        yield _state(study.name, read_result(stored["file"]), now) | {"sound": found.sound}
