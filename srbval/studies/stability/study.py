"""Largest step that `srbval simulate` accepts, by scene, solver and speed, and tests of the paper's claims about it.

The claims are tested by counting stable runs in the paper's scenes at the paper's step. The result of a claim contains
its quotation, `borne_out` (None if the runs do not cover it), and `answer`.
"""

from argparse import Namespace
from typing import Any

import pandas as pd

from srbval.models.estimates import ERROR_TOLERANCE as TOLERANCE
from srbval.models.health import ENERGY_LIMIT, FORCE_LIMIT, SLIDING, STEP_LIMIT
from srbval.models.solvers import METHODS
from srbval.progress import Progress
from srbval.studies.bench import STEPS_PER_S, stability
from srbval.studies.harness import StudyResult
from srbval.sweep.scenes import PAPER

SCENES = ("play0-outer", "interference-outer", "rig-outer")
RPM = (127.0, 355.0, 710.0, 1000.0, 1500.0, 3000.0, 6000.0)
# Limits that a run must keep to work, the same as in `srbval simulate`.
LIMITS = {**TOLERANCE, "sliding_cage": SLIDING, "energy": ENERGY_LIMIT, "force": FORCE_LIMIT, "step": STEP_LIMIT}
VERDICT = {True: "Borne out", False: "Not borne out", None: "Not covered"}
NONE_WORKS = "no explicit method works in every cell"
Row = dict[str, Any]


def claims(cells: pd.DataFrame) -> list[Row]:
    """Test two claims of the paper by the runs `cells`: lowest order of a stable solver, highest stable shaft speed."""
    own = cells[(cells["model"] == "full") & ((cells["dt_s"] / PAPER.step_s - 1).abs() < 1e-6)]
    fast, step = own["rpm"] > PAPER.limit_rpm, f"1/{1 / PAPER.step_s:.0f} s"
    explicit = [name for name, method in METHODS.items() if not method.implicit]
    counts = {name: count(own[~fast & (own["solver"] == name)]) for name in explicit}
    stable = [name for name, (good, of) in counts.items() if of and good == of]
    found = f"the lowest order that works in every cell is {stable[0]}" if stable else NONE_WORKS
    by_method = ", ".join(f"{name} in {good} of {of}" for name, (good, of) in counts.items())
    orders = f"up to {PAPER.limit_rpm:g} rpm at {step} {found} ({by_method})"
    lowest = stable[:1] == [PAPER.solver] if all(of for _, of in counts.values()) else None
    above, (good, of) = own[fast & (own["solver"] == PAPER.solver)], counts[PAPER.solver]
    every_speed_fails = not above.groupby("rpm")["stable"].all().any()
    limited = good == of and every_speed_fails if of and len(above) else None
    speeds = f"{PAPER.solver} at {step} works in {good} of {of} cells up to {PAPER.limit_rpm:g} rpm"
    speeds += " and in {} of {} above".format(*count(above))
    return [_claim(PAPER.lowest_order, lowest, orders), _claim(PAPER.speed_limit, limited, speeds)]


def count(cells: pd.DataFrame) -> tuple[int, int]:
    """Number of stable runs, and of all runs, in `cells`."""
    return int(cells["stable"].sum()), len(cells)


def _claim(quotation: str, borne_out: bool | None, text: str) -> Row:
    answer = f"{VERDICT[borne_out]}: “{quotation}”{'.' if borne_out is None else f': {text}.'}"
    return {"claim": quotation, "borne_out": borne_out, "answer": answer}


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Find the largest stable time steps; the result of a selection is stored only if the user names a file."""
    given = {name: tuple(own) for name in ("scenes", "solvers", "rpm") if (own := getattr(options, name))}
    asked: Row = {"scenes": SCENES, "rpm": RPM} | given
    found = stability(**asked, jobs=options.jobs, progress=progress)
    tested = claims(pd.DataFrame(found.content["cells"]))
    content = found.content | {"tolerances": LIMITS, "claims": tested, "steps_per_s": list(STEPS_PER_S)}
    text = "\n".join([found.text, "", *(claim["answer"] for claim in tested)])
    return StudyResult(name=None if given else "stability", content=content, text=text)
