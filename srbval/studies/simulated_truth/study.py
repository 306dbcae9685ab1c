"""What is found of simulated rigs whose truth is known: paths to the sensor, and sizes of defects.

`paths`: rigs of one known path, each with pulses, slip and noise of its own, through `identify`; the path's level in
third octaves against the true one and its 95 % interval, by Student's factor for what the bands leave over. A rig's
third octaves share its errors, so that the count's own standard error is taken over rigs.

`rough`: rigs that are runs of the scene `rig` with waves, others on the faulty bearing than on the healthy one. The
path is known there; what the smooth scene shows behind it is compared with each rig's increment. How far surfaces
scatter it, half of the rigs tell; scored are the others, and how many of them reject the true path, one with its modes
a tenth off, one without modes, and a hole 1.5 times as small or large, at one in a hundred.

`sizes`: the rig scene with another size, other inputs, behind a known path and over a background, with the path known,
and known to within the covariance of an identified one. Counted as resolved are sizes whose interval is within the
sizes that were simulated.
"""

import math
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import stdtrit

from srbval.bearing import Fault
from srbval.errors import NumericsError
from srbval.models.run import Run
from srbval.models.sensor import SensorFilter, along_sensor
from srbval.models.simulate import Step, simulate
from srbval.path.amplitudes import THIRD_OCTAVES, levels
from srbval.path.defect_size import LEVEL_U_DB, DefectSize, Runs, defect_size, size_runs
from srbval.path.identify import BAND_HZ, band_powers, identify
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.recordings import Recording, ShaftSpeed, SpeedSource
from srbval.scene import SensorPath, draws, load_scene, merge, rig_inputs
from srbval.studies.harness import Study, StudyResult
from srbval.studies.rig_amplitudes import STEP_S, moved_path
from srbval.studies.simulated_rig import BEARING, TRUE, background, behind, record, ring, simulated_rig

PARTS = ("paths", "rough", "sizes")
FIRST_SEED, NOISE, MISSED_DB = 3000, 0.05, 1.5  # of `paths`; the background [m/s2], also of `rough`
THIRD_OCTAVES_HZ = 10 ** (np.arange(27, 35) / 10)  # 500 to 2500 Hz, wholly within the band of the fit
WAVES_NM = 28.0
MOVED = replace(TRUE, modes=tuple(replace(mode, frequency_hz=1.1 * mode.frequency_hz) for mode in TRUE.modes))
REJECTED, OFTEN, HOLES = 0.01, 0.9, (1.0, 2 / 3, 1.5)
CASES = ((Fault.OUTER, 859.0), (Fault.INNER, 600.0))  # of `sizes`
SIZE_SECONDS = 1.0
EXTENTS_M = (1e-3, 4e-3)  # between which truths lie, evenly in the logarithm
SIZE_NOISE = 0.3  # of the background: as strong beside the fault of 2 mm as the rig's at 859 rpm
POWER, TRUTH_SEED = 3, 41
WAYS = {name: u_db for name, u_db in LEVEL_U_DB.items() if u_db != 2.0}  # bearings are not remounted here
NEAR = 0.2  # share of the size within which it was to be found
Row = dict[str, Any]


def paths(rigs: int, progress: Progress) -> Row:
    """Bias and coverage of identified paths, and how many modes were found."""
    errors, inside, modes = [], [], []
    truth, _ = TRUE.level_db(THIRD_OCTAVES_HZ)
    for number in range(rigs):
        progress("identify the paths of simulated rigs", number / rigs)
        rig = simulated_rig(FIRST_SEED + number, noise=NOISE, missed_db=MISSED_DB)
        found = identify(rig.fault, rig.healthy, rig.excitation, bearing=BEARING)
        level, u = found.path.level_db(THIRD_OCTAVES_HZ)
        assert found.levels_db is not None
        spare = len(found.levels_db) - 2 - 3 * len(found.path.modes)
        errors.append(level - truth)
        inside.append(np.abs(level - truth) <= stdtrit(spare, 0.975) * u)
        modes.append(len(found.path.modes))
    columns = zip(THIRD_OCTAVES_HZ, np.mean(errors, 0), np.std(errors, 0), np.mean(inside, 0), strict=True)
    share = np.mean(inside, axis=1)
    return {
        "rows": [{"hz": hz, "bias_db": b, "scatter_db": s, "covered": c} for hz, b, s, c in columns], "rigs": rigs,
        "bias_db": np.mean(errors), "covered": share.mean(), "covered_u": np.std(share, ddof=1) / np.sqrt(rigs),
        "modes": np.bincount(modes),
    }  # fmt: skip


def rough(rigs: int, progress: Progress) -> Row:
    """What rough rigs say of the increments of the smooth scene behind the known path."""
    smooth = {size: record("smooth", Fault.OUTER, ring(Fault.OUTER, size=size)) for size in HOLES}
    model = levels(behind(smooth[1.0], np.random.default_rng(0), 0.0), None)
    errors, reading, evidence = [], [], []
    for number in range(rigs):
        progress("rigs with waves", number / rigs)
        seed = FIRST_SEED + number
        random = np.random.default_rng(seed)
        fault, healthy = (
            behind(record("rough", state, ring(state, WAVES_NM, 2 * seed + i)), random, NOISE)
            for i, state in enumerate((Fault.OUTER, Fault.HEALTHY))
        )
        rig = levels(fault, healthy)
        errors.append([model[name].value - rig[name].value if rig[name].present else np.nan for name in THIRD_OCTAVES])
        reading.append([rig[name].ci95 for name in THIRD_OCTAVES])
        evidence.append({size: band_powers(fault, healthy, run, bearing=BEARING, band_hz=BAND_HZ)
                         for size, run in smooth.items()})  # fmt: skip
    known, off = np.split(np.array(errors), [rigs // 2])
    often = np.isfinite(off).mean(axis=0) >= OFTEN  # of the others only those that chance lifts are shown
    shown = np.isfinite(known).sum(axis=0)
    scatter = np.nanstd(known, axis=0, ddof=1) * np.sqrt(1 + 1 / shown) * stdtrit(shown - 1, 0.975)
    own = np.array(reading[rigs // 2 :])
    inside = {"reading": np.abs(off) <= own, "with surfaces": np.abs(off) <= np.hypot(own, scatter)}
    columns = zip(THIRD_OCTAVES, np.isfinite(off).sum(axis=0), np.nanmean(off, axis=0), scatter, strict=True)
    bias, shown_off = np.nanmean(off[:, often], axis=1), np.isfinite(off[:, often])
    first, others = evidence[: rigs // 2], evidence[rigs // 2 :]
    tau = brentq(lambda db: np.median([one[1.0].chance(TRUE, db) for one in first]) - 0.5, 0.1, 20)
    asked = {"true": (1.0, TRUE), "modes 10 % off": (1.0, MOVED), "no modes": (1.0, replace(TRUE, modes=()))}
    asked |= {f"hole times {size:.2g}": (size, TRUE) for size in HOLES[1:]}
    return {
        "rows": [{"third octave": name, "shown": n, "bias_db": b, "U_surfaces_db": u} for name, n, b, u in columns],
        "waviness_nm": WAVES_NM, "rigs": rigs, "bias_db": bias.mean(), "scatter_db": tau,
        "bias_u_db": bias.std() / np.sqrt(bias.size - 1),
        "covered": {how: of[:, often][shown_off].mean() for how, of in inside.items()},
        "rejected": {name: sum(one[size].chance(path, tau) < REJECTED for one in others)
                     for name, (size, path) in asked.items()},
    }  # fmt: skip


def sizes(truths: int, progress: Progress) -> Row:
    """Sizes found of `truths` defects of each fault, a power of two, by path and way of finding."""
    random, found = np.random.default_rng(TRUTH_SEED), []
    changes = draws(rig_inputs(), round(math.log2(truths)), seed=TRUTH_SEED)
    for number, (state, rpm) in enumerate(CASES):
        own = {"defect": {"kind": state}, "shaft_speed": f"{rpm} rpm", "duration_s": SIZE_SECONDS}
        scene = load_scene("rig", own)
        asked = at_speed(rpm, "asked", state, np.zeros(scene.samples))
        runs = size_runs(asked, scene, [load_scene("rig", merge(own, one)) for one in draws(rig_inputs(), POWER)])
        for place, one in enumerate(changes):
            progress(f"{state}, {rpm} rpm", (number + place / len(changes)) / len(CASES))
            extent_m = math.exp(random.uniform(*np.log(EXTENTS_M)))
            changed = merge(own, merge(one, {"defect": {"extent_m": extent_m}, "solver": {"step_s": STEP_S}}))
            run = simulate(load_scene("rig", changed), step=Step.UNCHECKED)
            if not run.status.usable:
                raise NumericsError(f"defect size: the run of the {state} fault failed ({run.status}): {run.reason}")
            seed = number * len(changes) + place
            for path, known, true in tried_paths(seed):
                found.append((path, state, extent_m, found_size(run, rpm, runs, seed, known, true)))
    return {"truths": truths, "rows": list(counted(found))}


def tried_paths(seed: int) -> Iterator[tuple[str, SensorPath, SensorPath]]:
    """The known and the true path: the same, or the true one drawn from the covariance of an identified one."""
    yield "known", TRUE, TRUE
    drawn = np.random.default_rng(seed).multivariate_normal(identified().parameters, np.array(identified().covariance))
    yield "within its covariance", identified(), moved_path(identified(), drawn) or identified()


@cache
def identified() -> SensorPath:
    """A path found from records, with its covariance."""
    rig = simulated_rig(1, missed_db=MISSED_DB)
    return identify(rig.fault, rig.healthy, rig.excitation, bearing=BEARING).path


def at_speed(rpm: float, name: str, state: Fault, samples: np.ndarray) -> Recording:
    """A record at another speed."""
    speed = ShaftSpeed(value_hz=rpm / 60, ci95_hz=0.001, source=SpeedSource.TACHOMETER)
    return replace(record(name, state, samples), speed=speed)


def found_size(
    run: Run, rpm: float, runs: tuple[Runs, Runs], seed: int, known: SensorPath, true: SensorPath
) -> DefectSize:
    """Of a run behind the true path, faulty and healthy record each with its own background."""
    random, state = np.random.default_rng(seed), run.scene.defect.kind
    shown = SensorFilter(true, run.scene.output_rate_hz).add(along_sensor(run.acceleration_m_s2))
    noise = [background(random, SIZE_NOISE)[: shown.size] for _ in range(2)]
    fault, healthy = at_speed(rpm, "true", state, shown + noise[0]), at_speed(rpm, "H", Fault.HEALTHY, noise[1])
    return defect_size(fault, healthy, runs, known, bearing=BEARING, ways=WAYS)


def counted(found: list[tuple[str, Fault, float, DefectSize]]) -> Iterator[Row]:
    """Counts for each path, fault and way of finding."""
    for path in dict.fromkeys(path for path, *_ in found):
        for fault in (*(state for state, _ in CASES), None):
            members = [(true, one) for of, state, true, one in found if of == path and fault in (state, None)]
            for way in WAYS:
                pairs = [(true, one.sizes[way]) for true, one in members]
                whole = [(true, size) for true, size in pairs if size.low_m and size.high_m]
                ratio = np.array([size.extent_m / true for true, size in whole])
                wide = [math.log((s.high_m or 1) / (s.low_m or 1)) for _, s in whole]
                beyond = ((s.high_m or 0) < 1.5 * true and (s.low_m or 0) > true / 1.5 for true, s in whole)
                yield {
                    "path": path, "fault": fault or "all", "from": way, "truths": len(pairs), "resolved": len(whole),
                    "within 20 %": int(np.sum(np.abs(ratio - 1) <= NEAR)), "1.5 times rejected": sum(beyond),
                    "bias %": 100 * (math.exp(float(np.mean(np.log(ratio)))) - 1),
                    "scatter %": 100 * float(np.std(np.log(ratio))),
                    "covered": sum((s.low_m or 0) <= true <= (s.high_m or math.inf) for true, s in pairs),
                    "half width %": 50 * float(np.median(wide)),
                }  # fmt: skip


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--part", choices=PARTS, help="only this part, not stored without -o")
    parser.add_argument("--rigs", metavar="N", type="count", default=100, help="of known path (default: 100)")
    parser.add_argument("--rough-rigs", metavar="N", type="count", default=80, help="with waves (default: 80)")
    parser.add_argument("--truths", metavar="N", type="count", default=8, help="sizes of each fault, a power of two")


def _run(options: Namespace, progress: Progress) -> StudyResult:
    counts = dict(zip(PARTS, (options.rigs, options.rough_rigs, options.truths), strict=True))
    content, texts = dict[str, Row](), []
    for part, run in zip(PARTS, (paths, rough, sizes), strict=True):
        if options.part in (part, None):
            content[part] = run(counts[part], progress)
            rest = "; ".join(f"{key} {value}" for key, value in content[part].items() if key != "rows")
            texts.append(f"{part}: {rest}\n{text_rows(content[part]['rows'])}")
    name = None if options.part else "simulated_truth"
    return StudyResult(name=name, content=content, text="\n\n".join(texts))


STUDY = Study(
    question="How biased are identified paths and sizes of simulated rigs, and do their intervals cover the truth?",
    minutes=25, run=_run, options=_options,
)  # fmt: skip
