"""Blind spots of the fingerprint of behaviour: which planted errors change its runs, and which of the others matter.

    python -m tests.verification.planted_fingerprint [--jobs N] [--every N] [-o FILE.json]

Every error of ``planted_errors.toml`` is planted alone. The runs of the fingerprint are continued from stored states,
uncompiled, for two output intervals; an error that changes one of them by more than the fingerprint's tolerance changes
the fingerprint. Any other error is planted in states of the scenes of published numbers, late in their runs: if it
changes one of these, it is a blind spot.
"""

import argparse
import json
import os
import pickle
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from tests.verification.planted import plant

HERE = Path(__file__).parent
PROBE, PUBLISHED = "fingerprint", "published"
CHANGED, BLIND, HARMLESS, FAILED = "changes the fingerprint", "blind spot", "changes no published number", "failed"
OUTPUTS = 2  # output intervals that are run from each state
PROBE_AT, PUBLISHED_AT = (0, 60, 150), (0, 1024, 2500)  # output intervals before the states, of 1/20480 s


def scenes(stage: str) -> Iterator[tuple[str, Any]]:
    """Scenes of the fingerprint's parts that run kernels, or of published numbers, by name."""
    from srbval.bearing import RACE_DEFECTS, Fault
    from srbval.check import check as probes

    races = (Fault.HEALTHY, *RACE_DEFECTS)
    yield from probes._probe_scenes("full", "paper", fits=("play", "printed"))
    yield from probes._probe_scenes("slices", "rig")
    yield from probes._probe_scenes("slices", "rig-oil", states=(Fault.HEALTHY,))
    yield from probes._probe_scenes("line", "paper", fits=("printed",), states=races)
    if stage == PROBE:
        for solver in probes.PROBED_SOLVERS:
            changes = {"solver": {"name": solver, "step_s": probes.SOLVER_STEP_S}}
            yield from (
                (f"{solver} {name}", scene)
                for name, scene in probes._probe_scenes(
                    "full", "paper", fits=("printed",), states=(Fault.OUTER,), changes=changes
                )
            )


def prepare(file: Path) -> None:
    """Store the states from which runs are continued; with the compiled kernels."""
    from srbval.bearing import load_bearing
    from srbval.models.full_run import start_full_run

    found = []
    for stage, places in ((PROBE, PROBE_AT), (PUBLISHED, PUBLISHED_AT)):
        for name, scene in scenes(stage):
            run, done = start_full_run(scene, load_bearing(scene.bearing)), 0
            for place in places:
                run.advance(done, place - done)
                done = place
                found.append((stage, f"{name}, output {place}", place, pickle.dumps(run)))
    file.write_bytes(pickle.dumps(found))


def continued(file: Path) -> Iterator[tuple[str, str, Any]]:
    """Stage, name and outputs of every state, continued in this process."""
    for stage, name, place, stored in pickle.loads(file.read_bytes()):
        with np.errstate(all="ignore"):
            yield stage, name, pickle.loads(stored).advance(place, OUTPUTS).out


def child(error: dict[str, str] | None, folder: Path) -> str:
    """What the planted error does in this process; without an error, the outputs are stored."""
    from srbval.storage.stored_result import RELATIVE_TOLERANCE

    if error is None:
        (folder / "known").write_bytes(pickle.dumps([out for *_, out in continued(folder / "states")]))
        return "unharmed outputs stored"
    plant(error)
    known = pickle.loads((folder / "known").read_bytes())
    scale = np.max([np.abs(out).max(axis=0) for out in known], axis=0)
    try:
        for right, (stage, name, out) in zip(known, continued(folder / "states"), strict=True):
            if not np.all(np.abs(out - right) <= RELATIVE_TOLERANCE * np.maximum(np.abs(right), 1e-6 * scale)):
                return f"{CHANGED if stage == PROBE else BLIND}: {name}"
    except Exception as failure:  # whatever a planted error raises is a change of behaviour
        return f"{CHANGED}: {type(failure).__name__}"
    return HARMLESS


def outcome(error: dict[str, str] | None, folder: Path) -> str:
    """Run `child` uncompiled, in a process of its own."""
    root = HERE.parents[1]
    paths = os.pathsep.join([str(root), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "tests.verification.planted_fingerprint", "--child", str(folder)]
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": paths}
    ended = subprocess.run(
        command, input=json.dumps(error), env=environment, cwd=root, capture_output=True, text=True, check=False
    )
    lines = ended.stdout.splitlines()
    return lines[-1] if ended.returncode == 0 and lines else f"{FAILED}: {ended.stderr[-300:]}"


def main() -> int:
    """Plant the errors; exit code 1 if there is a blind spot or a process failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--every", type=int, default=1, help="plant every N-th error only")
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        print(child(json.load(sys.stdin), options.child).replace("\n", " "))
        return 0
    errors = tomllib.loads((HERE / "planted_errors.toml").read_text())["error"][:: options.every]
    found = {}
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(options.jobs) as pool:
        prepare(Path(folder, "states"))
        print(outcome(None, Path(folder)), flush=True)
        for error, text in zip(errors, pool.map(lambda error: outcome(error, Path(folder)), errors), strict=True):
            found[error["what"]] = text
            print(f"{error['file']}, {error['what']}: {text}", flush=True)
    print(dict(Counter(text.partition(":")[0] for text in found.values())))
    if options.output:
        options.output.write_text(json.dumps(found, indent=1))
    return int(any(text.startswith((BLIND, FAILED)) for text in found.values()))


if __name__ == "__main__":
    sys.exit(main())
