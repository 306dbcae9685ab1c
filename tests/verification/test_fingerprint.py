"""Blind spots of the fingerprint of behaviour: which planted errors change its runs, and which of the others matter.

Every error of ``planted_errors.toml`` is planted alone. The runs of the fingerprint are continued from stored states,
uncompiled, for two output intervals; an error that changes one of them by more than the fingerprint's tolerance changes
the fingerprint. Any other error is planted in states of the scenes of published numbers, late in their runs: if it
changes one of these, it is a blind spot.
"""

import math
import pickle
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.verification.planted import plant, processes
from tests.verification.test_planted_errors import ERRORS, PROCESSES, UNHARMED

PROBE, PUBLISHED = "fingerprint", "published"
CHANGED, BLIND, HARMLESS = "changes the fingerprint", "blind spot", "changes no published number"
OUTPUTS = 2  # output intervals that are run from each state
PROBE_AT, PUBLISHED_AT = (0, 30, 150), (0, 1024, 2500)  # output intervals before the states, of 1/20480 s


def scenes(stage: str) -> Iterator[tuple[str, Any]]:
    """Scenes of the fingerprint's parts that run kernels, or of published numbers, by name."""
    from srbval import check as probes
    from srbval.bearing import RACE_DEFECTS, Fault

    races = (Fault.HEALTHY, *RACE_DEFECTS)
    yield from probes._probe_scenes("full", "paper", duration_s=probes.UNSTABLE_S)
    yield from probes._probe_scenes("full", "paper", fits=("printed",))
    yield from probes._probe_scenes("slices", "rig")
    yield from probes._probe_scenes("slices", "rig-oil", states=(Fault.HEALTHY,))
    yield from probes._probe_scenes("line", "paper", fits=("printed",), states=races)
    for solver in probes.PROBED_SOLVERS if stage == PROBE else ():
        own = {"solver": {"name": solver, "step_s": probes.SOLVER_STEP_S}, "duration_s": probes.UNSTABLE_S}
        for name, scene in probes._probe_scenes("full", "paper", fits=("printed",), states=(Fault.OUTER,), **own):
            yield f"{solver} {name}", scene


def states() -> Iterator[tuple[str, str, int, bytes]]:
    """Stage, name, place and content of the states from which runs are continued; with the compiled kernels."""
    from srbval.bearing import load_bearing
    from srbval.models.full_run import start_full_run

    for stage, places in ((PROBE, PROBE_AT), (PUBLISHED, PUBLISHED_AT)):
        for name, scene in scenes(stage):
            run, done = start_full_run(scene, load_bearing(scene.bearing)), 0
            last = scene.duration_s * scene.output_rate_hz - OUTPUTS if stage == PROBE else math.inf
            for place in (one for one in places if one <= last):
                run.advance(done, place - done)
                done = place
                yield stage, f"{name}, output {place}", place, pickle.dumps(run)


def continued(folder: Path) -> Iterator[tuple[str, str, Any]]:
    """Stage, name and outputs of every state, continued in this process."""
    for stage, name, place, stored in pickle.loads((folder / "states").read_bytes()):
        with np.errstate(all="ignore"):
            yield stage, name, pickle.loads(stored).advance(place, OUTPUTS).out


def store_unharmed(folder: Path) -> None:
    """Store the outputs without an error, uncompiled as the others."""
    plant(UNHARMED)
    (folder / "unharmed").write_bytes(pickle.dumps([out for *_, out in continued(folder)]))


def effect(error: dict[str, str], folder: Path) -> str:
    """Plant an error in this process and return its effect on the fingerprint as text."""
    plant(error)
    from srbval.storage.stored_result import RELATIVE_TOLERANCE

    unharmed = pickle.loads((folder / "unharmed").read_bytes())
    scale = np.max([np.abs(out).max(axis=0) for out in unharmed], axis=0)
    try:
        for right, (stage, name, out) in zip(unharmed, continued(folder), strict=True):
            if not np.all(np.abs(out - right) <= RELATIVE_TOLERANCE * np.maximum(np.abs(right), 1e-6 * scale)):
                return f"{CHANGED if stage == PROBE else BLIND}: {name}"
    except Exception as failure:  # whatever a planted error raises is a change of behaviour
        return f"{CHANGED}: {type(failure).__name__}"
    return HARMLESS


@pytest.mark.long_form
@pytest.mark.timeout(3 * 3600)
def test_every_planted_error_that_changes_a_published_number_changes_the_fingerprint(tmp_path):
    (tmp_path / "states").write_bytes(pickle.dumps([*states()]))
    with processes(PROCESSES) as pool:
        pool.apply(store_unharmed, (tmp_path,))
        found = list(pool.imap(partial(effect, folder=tmp_path), ERRORS))
    blind = [(error["what"], text) for error, text in zip(ERRORS, found, strict=True) if text.startswith(BLIND)]
    assert blind == []
    assert Counter(text.partition(":")[0] for text in found)[CHANGED] > len(ERRORS) / 2
