"""Sizes of defects from simulated records.

Truth is the rig scene with another size, other inputs, behind a known path and over a background; what is found is held
against it, with the path known, and known to within the covariance of an identified one. Counted as resolved are sizes
whose interval is within the sizes that were simulated.
"""

import math
from argparse import ArgumentParser, Namespace
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.errors import NumericsError
from srbval.models.band_levels import along_sensor
from srbval.models.run import Run
from srbval.models.sensor_filter import SensorFilter
from srbval.models.simulate import Step, simulate
from srbval.path.defect_size import LEVEL_U_DB, DefectSize, Runs, defect_size, size_runs
from srbval.path.identify import identify
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.recordings import Recording, ShaftSpeed, SpeedSource
from srbval.scene import Scene, SensorPath, draws, load_scene, merge, rig_inputs
from srbval.studies.harness import Study, StudyResult
from srbval.studies.rig_amplitudes import STEP_S, moved_path
from srbval.studies.simulated_rig import BEARING, TRUE, background, record, simulated_rig

CASES = ((Fault.OUTER, 859.0), (Fault.INNER, 600.0))
SECONDS = 1.0
EXTENTS_M = (1e-3, 4e-3)  # between which truths lie, evenly in the logarithm
NOISE = 0.3  # of the background: as strong beside the fault of 2 mm as the rig's at 859 rpm
POWER, TRUTH_SEED = 3, 41
WAYS = {name: u_db for name, u_db in LEVEL_U_DB.items() if u_db != 2.0}  # bearings are not remounted here
NEAR = 0.2  # share of the size within which it was to be found


@dataclass(frozen=True, kw_only=True)
class FoundSize:
    """A truth, and what was found."""

    state: Fault
    extent_m: float
    size: DefectSize


def records(run: Run, seed: int, path: SensorPath) -> tuple[Recording, Recording]:
    """The faulty and the healthy record of a run behind a path, each with its own background."""
    random, scene = np.random.default_rng(seed), run.scene
    shown = SensorFilter(path, scene.output_rate_hz).add(along_sensor(run.acceleration_m_s2))
    noise = [background(random, NOISE)[: shown.size] for _ in range(2)]
    return like(scene, "true", scene.defect.kind, shown + noise[0]), like(scene, "H", Fault.HEALTHY, noise[1])


def like(scene: Scene, name: str, state: Fault, samples: FloatArray) -> Recording:
    """A record at the scene's speed."""
    hz = scene.shaft_speed_rad_s / (2 * math.pi)
    return replace(
        record(name, state, samples), speed=ShaftSpeed(value_hz=hz, ci95_hz=0.001, source=SpeedSource.TACHOMETER)
    )


def runs_at(own: dict[str, Any]) -> tuple[Runs, Runs]:
    """What the command runs, for one fault at one speed."""
    scene = load_scene("rig", own)
    asked = like(scene, "asked", scene.defect.kind, np.zeros(scene.samples))
    return size_runs(asked, scene, [load_scene("rig", merge(own, one)) for one in draws(rig_inputs(), POWER)])


def trial(run: Run, runs: tuple[Runs, Runs], seed: int, path_off: bool) -> FoundSize:
    """One truth, behind the known path or, where that is off, one drawn about an identified one."""
    known = true = TRUE
    if path_off:
        known, random = identified(), np.random.default_rng(seed)
        drawn = random.multivariate_normal(known.parameters, np.array(known.covariance))
        true = moved_path(known, drawn) or known
    size = defect_size(*records(run, seed, true), runs, known, bearing=BEARING, ways=WAYS)
    return FoundSize(state=run.scene.defect.kind, extent_m=run.scene.defect.extent_m or 0.0, size=size)


@cache
def identified() -> SensorPath:
    """A path found from records, with its covariance."""
    rig = simulated_rig(1, missed_db=1.5)
    return identify(rig.fault, rig.healthy, rig.excitation, bearing=BEARING).path


def rows(found: list[FoundSize], name: str) -> dict[str, object]:
    """Counts for one of the ways of finding."""
    sizes = [(one.extent_m, one.size.sizes[name]) for one in found]
    whole = [(true, size) for true, size in sizes if size.low_m and size.high_m]
    ratio = [size.extent_m / true for true, size in whole]
    return {
        "from": name, "truths": len(sizes), "resolved": len(whole),
        "within 20 %": sum(abs(one - 1) <= NEAR for one in ratio),
        "1.5 times rejected": sum((s.high_m or 0) < 1.5 * true and (s.low_m or 0) > true / 1.5 for true, s in whole),
        "bias %": 100 * (math.exp(float(np.mean(np.log(ratio)))) - 1),
        "scatter %": 100 * float(np.std(np.log(ratio))),
        "covered": sum((size.low_m or 0) <= true <= (size.high_m or math.inf) for true, size in sizes),
        "half width %": 50 * float(np.median([math.log((s.high_m or 1) / (s.low_m or 1)) for _, s in whole])),
    }  # fmt: skip


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--truths", metavar="N", type="count", default=8, help="of each fault, a power of two")


def _run(options: Namespace, progress: Progress) -> StudyResult:
    random = np.random.default_rng(TRUTH_SEED)
    changes = draws(rig_inputs(), round(math.log2(options.truths)), seed=TRUTH_SEED)
    found: dict[str, list[FoundSize]] = {"known": [], "within its covariance": []}
    for number, (state, rpm) in enumerate(CASES):
        own = {"defect": {"kind": state}, "shaft_speed": f"{rpm} rpm", "duration_s": SECONDS}
        runs = runs_at(own)
        for place, one in enumerate(changes):
            progress(f"{state}, {rpm} rpm", (number + place / len(changes)) / len(CASES))
            extent_m = math.exp(random.uniform(*np.log(EXTENTS_M)))
            changed = merge(own, merge(one, {"defect": {"extent_m": extent_m}, "solver": {"step_s": STEP_S}}))
            run = simulate(load_scene("rig", changed), step=Step.UNCHECKED)
            if not run.status.usable:
                raise NumericsError(f"defect size: the run of the {state} fault failed ({run.status}): {run.reason}")
            for path, members in found.items():
                members.append(trial(run, runs, len(members), path != "known"))
    progress("sizes", 1.0)
    counted = [
        {"path": path, "fault": of or "all"} | rows([one for one in members if of in (one.state, None)], name)
        for path, members in found.items() for of in (*(state for state, _ in CASES), None) for name in WAYS
    ]  # fmt: skip
    return StudyResult(name="defect_size", content={"truths": options.truths, "rows": counted}, text=text_rows(counted))


STUDY = Study(question="How well are sizes of defects found?", minutes=10, run=_run, options=_options)
