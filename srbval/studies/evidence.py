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
from dataclasses import dataclass
from typing import Any

from srbval.check.fingerprint import fingerprint
from srbval.errors import ConfigurationError
from srbval.progress import Progress, prefixed, silent
from srbval.recordings.manifest import HOME_VARIABLE
from srbval.recordings.registry import RECORDINGS_VARIABLE
from srbval.storage.behaviour import Fingerprint
from srbval.storage.installation import git_revision, is_source_tree, shipped_folder
from srbval.storage.stored_result import REPORTS, ResultKind, StoredResult, newest_result, read_result
from srbval.studies.harness import Study, load_study, make_result, study_names


@dataclass(frozen=True, kw_only=True)
class ResultState:
    """A result by name: its kind, whether it is `fresh` and else `why` not, and its origin; `sound` as its study says.

    `minutes` is the wall time of its computation, None if it was never computed or does not state it.
    """

    name: str
    kind: ResultKind
    fresh: bool
    why: str | None
    made_utc: str | None = None
    machine: str | None = None
    minutes: float | None = None
    sound: bool = True


def result_states(now: Fingerprint) -> list[ResultState]:
    """The state of every study's result, and of every other result that comes with the program, by name."""
    names = {*study_names(), *(path.stem for path in shipped_folder(REPORTS).glob("*.json"))}
    found = []
    for name in sorted(names):
        result, study = newest_result(name), load_study(name) if name in study_names() else None
        if result is not None or study is not None:
            found.append(_state(name, result, study, now))
    return found


def _state(name: str, result: StoredResult | None, study: Study | None, now: Fingerprint) -> ResultState:
    if result is None:
        kind = ResultKind.EVIDENCE if study is None else study.kind
        return ResultState(name=name, kind=kind, fresh=False, why="it was never computed")
    why, origin = result.why_stale(now), result.origin
    return ResultState(
        name=name,
        kind=result.kind,
        fresh=why is None,
        why=why,
        made_utc=result.made_utc,
        machine=origin["processor"],
        minutes=origin["minutes"],
    )


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
) -> Iterator[ResultState]:
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
    wanted, kept = list[tuple[Study, ResultState]](), list[tuple[Study, ResultState]]()
    for study in (one for one in studies if one.kind is ResultKind.EVIDENCE):
        state = _state(study.name, newest_result(study.name), study, now)
        (wanted if every or not state.fresh else kept).append((study, state))
    yield from (state for _, state in kept)
    minutes = sum(study.minutes for study, _ in wanted)
    if wanted:
        message(f"{len(wanted)} results to compute, about {minutes:.0f} minutes on two cores")
    for study, state in wanted:
        message(f"{study.name}: {state.why or 'fresh'}; about {study.minutes:g} minutes on two cores")
        started = time.perf_counter()
        output = shipped_folder(REPORTS) / f"{study.name}.json" if is_source_tree() else None
        options = argparse.Namespace(**study.defaults(), jobs=jobs, output=output)
        origin: dict[str, Any] = {"command": command, "revision": revision, "behaviour": now}
        with without_own_recordings():
            found, stored = make_result(study.name, options, prefixed(progress, study.name), **origin)
        done: dict[str, Any] = vars(_state(study.name, read_result(stored["file"]), study, now))
        message(f"{study.name}: stored after {(time.perf_counter() - started) / 60:.1f} minutes")
        yield ResultState(**done | {"sound": found.sound})
