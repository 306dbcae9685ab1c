"""Blind spots of the fingerprint of behaviour: which planted errors change it, and which of the others matter.

    python -m tests.verification.planted_fingerprint [--jobs N] [--every N] [-o FILE.json]

Every error of ``planted_errors.toml`` is planted alone, and the parts of the fingerprint that run the kernels are
computed one after another until one differs from the unharmed program. If none does, the scenes of published numbers
are run for 0.3 s: an error that changes them and no fingerprint is a blind spot. Kernels are compiled without
optimisation, which is faster here and leaves the arithmetic as it is.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from tests.verification.planted import plant

HERE = Path(__file__).parent
PARTS = ("full", "slices", "oil", "line")
PUBLISHED_S = 0.3
CHANGED, BLIND, HARMLESS, FAILED = "changes the fingerprint", "blind spot", "changes no published number", "failed"


def numbers(stage: str) -> dict[str, Any]:
    """The numbers of one stage: a part of the fingerprint, or the runs of published scenes."""
    from srbval.bearing import RACE_DEFECTS, Fault
    from srbval.check import fingerprint as probes

    if stage != "published":
        return dict(probes.PARTS[stage]())
    states = (Fault.HEALTHY, *RACE_DEFECTS)
    found = probes._of_model("full", "paper", fits=("play", "printed"), states=states, seconds=PUBLISHED_S)
    for rpm in (340, 859):
        changes = {"shaft_speed_rad_s": rpm * math.pi / 30}
        made = probes._of_model("slices", "rig", changes=changes, seconds=PUBLISHED_S)
        found |= {f"{rpm} {name}": value for name, value in made.items()}
    return found | probes._of_model("slices", "rig-oil", states=(Fault.HEALTHY,), seconds=PUBLISHED_S)


def child(error: dict[str, str], known: dict[str, dict[str, Any]]) -> str:
    """What the planted error does, in this process."""
    from srbval.storage.behaviour import differing, fingerprint_of

    plant(error)
    for stage in (*PARTS, "published"):
        try:
            changed = differing(fingerprint_of({"": known[stage]})[""], numbers(stage))
        except Exception as failure:  # whatever a planted error raises is a change of behaviour
            changed = [f"{type(failure).__name__}: {failure}"]
        if changed:
            return f"{BLIND if stage == 'published' else CHANGED}: {stage}, {changed[0]}"
    return HARMLESS


def outcome(error: dict[str, str] | None, known: Path) -> str:
    """Run `child` in a process of its own, with an empty cache of compiled kernels."""
    with tempfile.TemporaryDirectory() as cache:
        environment = os.environ | {"NUMBA_CACHE_DIR": cache, "XDG_CACHE_HOME": cache, "NUMBA_OPT": "0"}
        environment |= {"PYTHONPATH": os.pathsep.join([str(HERE.parents[1]), os.environ.get("PYTHONPATH", "")])}
        command = [sys.executable, "-m", "tests.verification.planted_fingerprint", "--child", str(known)]
        ended = subprocess.run(
            command, input=json.dumps(error), env=environment, cwd=HERE.parents[1], capture_output=True, text=True,
            check=False,
        )  # fmt: skip
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
        error = json.load(sys.stdin)
        if error is None:
            from srbval.storage.json_files import to_json

            options.child.write_text(json.dumps(to_json({stage: numbers(stage) for stage in (*PARTS, "published")})))
            print("known")
        else:
            print(child(error, json.loads(options.child.read_text())).replace("\n", " "))
        return 0
    errors = tomllib.loads((HERE / "planted_errors.toml").read_text())["error"][:: options.every]
    with tempfile.TemporaryDirectory() as folder:
        known = Path(folder) / "known.json"
        print("unharmed:", outcome(None, known), flush=True)
        with ThreadPoolExecutor(options.jobs) as pool:
            found = dict(zip((one["what"] for one in errors), _shown(pool, errors, known), strict=True))
    print(Counter(text.partition(":")[0] for text in found.values()))
    if options.output:
        options.output.write_text(json.dumps(found, indent=1))
    return int(any(text.startswith((BLIND, FAILED)) for text in found.values()))


def _shown(pool: ThreadPoolExecutor, errors: list[dict[str, str]], known: Path) -> Iterator[str]:
    for error, text in zip(errors, pool.map(lambda one: outcome(one, known), errors), strict=True):
        print(f"{error['file']}, {error['what']}: {text}", flush=True)
        yield text


if __name__ == "__main__":
    sys.exit(main())
