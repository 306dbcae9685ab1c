"""What a run's health says where the truth is known.

Scenes are drawn, each is run by several methods and steps and compared with imex2 at an eighth of the paper's
step. A run is like it within 1e-3 in cage speed and 20 % in 500-1500 Hz RMS and drive power; a quantity counts only
where imex2 at a quarter of the step has it within half of that, as rattling does not converge in a short run. Counted
by status and caution; one JSON line a run goes to the file that SRBVAL_HEALTH names. With SRBVAL_STEP=checked the
estimate of the step's error takes part in the status.
"""

import json
import os
import random
from argparse import ArgumentParser, Namespace
from collections import Counter
from dataclasses import dataclass
from typing import Any

from srbval.errors import ConfigurationError
from srbval.models.run import USABLE, RunStatus
from srbval.models.simulate import Step
from srbval.plan.measures import band_rms
from srbval.plan.timing import attempt
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.scene import Scene, load_scene, merge, paper_scene
from srbval.studies.harness import Study, StudyResult

RATE_HZ, SECONDS = 15_360, 0.5
LIMITS = {"cage": 1e-3, "band": 0.2, "drive": 0.2}
TRUTHS = (("imex2", 8.0), ("imex2", 4.0))  # solver, steps in one of the paper's
TRIED = (("imex2", 2.0), *((s, n) for s in ("imex2", "ros2", "ode1", "ode2", "ode4") for n in (1.0, 0.5, 0.25)))
SPACE: dict[str, tuple[Any, ...]] = {
    "model": ("full", "full", "full", "line", "slices"),
    "rpm": (350, 710, 1500, 3000),
    "load_kn": (1, 5, 31, 125),
    "friction": (0.02, 0.1, 0.7),
    "path": ("housing", "bearing"),
    "fit": ("play 0", "play 0.1 mm", "printed"),
    "critical_velocity": ("1 mm/s", "0.1 m/s"),
    "defect": ("none", "outer", "inner"),
    "gravity": (False, True),
}
STEPS_OF = {"line": 3}  # of the scene's steps that the rung takes in one
RIG_SLOWER = 1.5  # the rig scene's own step over the paper's


@dataclass(frozen=True, kw_only=True)
class RunMeasures:
    """A run: status, is there a caution, cage ratio, band RMS [m/s2], drive power [W]; None where it was refused."""

    status: str
    caution: bool
    cage: float | None
    band: float | None
    drive: float | None

    def unlike(self, truth: "RunMeasures", unsure: "RunMeasures") -> str:
        """What of it is off: ``cage``, ``band``, nothing; ``unsure`` where the truth is in all."""
        pairs = tuple(
            (name, vars(self)[name], vars(truth)[name], vars(unsure)[name], limit) for name, limit in LIMITS.items()
        )
        sure = [p for p in pairs if p[2] and p[3] is not None and abs(p[3] / p[2] - 1) <= p[4] / 2]
        off = [name for name, own, right, _, limit in sure if own is None or not abs(own / right - 1) <= limit]
        return off[0] if off else "" if sure else "unsure"


def scene_of(point: dict[str, Any], solver: str, times: float) -> Scene:
    """The scene of a point of `SPACE` by a method, `times` of its steps in one of the paper's."""
    fit, mu = point["fit"], point["friction"]
    friction = {
        "static_friction": mu,
        "dynamic_friction": min(mu, 0.5),
        "critical_velocity": point["critical_velocity"],
    }
    fits = {"printed": {"roller_fit": "printed"}, "play 0.1 mm": {"radial_play": "0.1 mm"}}.get(fit, {})
    steps = round(4 * times * STEPS_OF.get(point["model"], 1))
    changes = {
        "model": point["model"], "shaft_speed": f"{point['rpm']} rpm", "duration": f"{SECONDS} s", "settle": "0.05 s",
        "output_rate": f"{RATE_HZ} Hz", "defect": {"kind": point["defect"]}, "contact": friction | fits,
        "load": {"radial": f"{point['load_kn']} kN", "path": point["path"], "gravity": point["gravity"]},
        "solver": {"name": solver, "step_s": 1 / (RATE_HZ * steps)},
    }  # fmt: skip
    if point["model"] == "slices":  # the rig's, at this speed and load
        apart = {"contact", "load"}
        rig = {k: v for k, v in changes.items() if k not in apart} | {"load": {"radial": changes["load"]["radial"]}}
        return load_scene("rig", rig)
    return paper_scene(**merge({}, changes))


def tried(scene: Scene) -> tuple[RunMeasures, str]:
    """Run a scene; its reason too."""
    ran = attempt(scene, step=Step(os.environ.get("SRBVAL_STEP", Step.UNCHECKED)))
    run, has = ran.run, ran.run is not None and ran.run.samples > RATE_HZ // 10
    return RunMeasures(
        status=ran.status,
        caution="with caution" in ran.reason or ran.status == RunStatus.INACCURATE,
        drive=float(run.energy.drive_w.mean()) if run is not None and run.samples else None,
        cage=run.cage_ratio if run is not None else None,
        band=band_rms(run.acceleration_m_s2[:, 1], RATE_HZ, SIMULATED_BAND_HZ) if run is not None and has else None,
    ), ran.reason


def count(scenes: int, seed: int) -> Counter[tuple[str, str, str]]:
    """Runs by status, ``caution`` or not, and what of them is unlike the truth."""
    draw, found, notes = random.Random(seed), Counter[tuple[str, str, str]](), os.environ.get("SRBVAL_HEALTH")
    for _ in range(scenes):
        point = {name: draw.choice(values) for name, values in SPACE.items()}
        runs = {}
        for method in TRUTHS + TRIED[: 2 if point["model"] == "slices" else None]:
            try:
                runs[method], reason = tried(scene_of(point, *method))
            except ConfigurationError:
                break
            if notes:
                with open(notes, "a", encoding="utf-8") as file:
                    file.write(json.dumps({**point, "method": method, **vars(runs[method]), "reason": reason}) + "\n")
        truth, unsure = (runs.get(method) for method in TRUTHS)
        if truth is None or unsure is None or truth.status not in USABLE:
            found["truth", truth.status if truth else "refused", ""] += 1
            continue
        for method, run in runs.items():
            off = "" if method in TRUTHS else run.unlike(truth, unsure)
            found[run.status, "caution" if run.caution else "", off] += 1
    return found


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--scenes", metavar="N", type="count", default=100, help="scenes drawn (default: 100)")
    parser.add_argument("--seed", metavar="N", type="seed", default=1, help="of the draw (default: 1)")


def _run(options: Namespace, _: Progress) -> StudyResult:
    found = count(options.scenes, options.seed)
    runs = sum(n for key, n in found.items() if key[0] != "truth")
    failed = sum(n for (status, _, off), n in found.items() if status not in (*USABLE, "truth") and not off)
    quiet = sum(n for (status, caution, off), n in found.items() if status in USABLE and not caution and off)
    plain = sum(n for (status, caution, _), n in found.items() if status in USABLE and not caution)
    rows = [{"status": s, "caution": c, "off": off, "runs": n} for (s, c, off), n in sorted(found.items())]
    text = (
        f"{text_rows(rows)}\n{runs} runs, {failed} failed though like the truth; {quiet} of {plain} without caution "
        "are unlike it"
    )
    content = {"scenes": options.scenes, "seed": options.seed, "rows": rows}
    return StudyResult(name="health_limits", content=content, text=text)


STUDY = Study(question="What does a run's health say where the truth is known?", minutes=20, run=_run, options=_options)
