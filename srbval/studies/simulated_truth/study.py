"""What is found of simulated rigs whose truth is known: paths to the sensor, and sizes of defects.

`paths`: rigs of one known path, each with pulses, slip and noise of its own, through `identify`; its gains in third
octaves, and the ratio of its directions, against the true ones and their 95 % intervals by the normal distribution.

`rough`: rigs that are runs of the scene `rig` with waves, another surface each. The path is known there; what the
smooth scene shows behind it is compared with the power that is locked to each rig's fault. How far surfaces scatter it,
half of the rigs tell; counted are the others.

`sizes`: the rig scene with a defect of three sizes at five places along and around the race, other inputs, behind a
known path and over a background. Counted as resolved are sizes whose interval is within those that were simulated.
"""

import itertools
import math
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.stats import t

from srbval.bearing import Fault
from srbval.models.simulate import Step, simulate
from srbval.path.amplitudes import locked_levels
from srbval.path.defect_size import LEVEL_U_DB, DefectSize, defect_size, size_runs
from srbval.path.identify import behind, identify, line_order
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.recordings import Recording, ShaftSpeed, SpeedSource
from srbval.scene import draws, load_scene, merge, rig_inputs
from srbval.signal import NORMAL_95
from srbval.studies.harness import StudyResult
from srbval.studies.rig_amplitudes import STEP_S
from srbval.studies.simulated_rig import BEARING, RATIO, TRUE, background, record_of, rough_run, simulated_rig

RIGS = 40  # of `paths` and of `rough`
FIRST_SEED, NOISE, MISSED_DB = 3000, 0.05, 0.0  # of `paths`; the background [m/s2], also of `rough`
WAVES_NM = 28.0
CASES = ((Fault.OUTER, 859.0), (Fault.INNER, 859.0))  # of `sizes`
SIZE_SECONDS = 1.0
EXTENTS_MM = (1.0, 2.0, 4.0)
PLACES = ((0.0, 0.0), (-40.0, 6.0), (-20.0, -9.0), (20.0, 3.0), (40.0, -4.0))  # angle [deg], along the roller [mm]
SIZE_NOISE = 0.3  # of the background: as strong beside the fault of 2 mm as the rig's at 859 rpm
POWER, TRUTH_SEED = 4, 41
NEAR = 0.2  # share of the size within which it was to be found
Row = dict[str, Any]


def paths(rigs: int, progress: Progress) -> Row:
    """Bias, scatter and coverage of identified gains and of the ratio of both directions."""
    count = len(TRUE.load)
    off_db, u_db = np.full((2, rigs, count + 1), np.nan)
    for number in range(rigs):
        progress("identify the paths of simulated rigs", number / rigs)
        rig = simulated_rig(FIRST_SEED + number, noise=NOISE, missed_db=MISSED_DB)
        path = identify(rig.outer, rig.inner, bearing=BEARING).path
        first = int(np.argmin(np.abs(np.array(TRUE.frequency_hz) - path.frequency_hz[0])))
        own = [*range(first, first + len(path.load)), count]
        gains = (*(np.array(path.load) / np.array(TRUE.load)[own[:-1]]), path.cross[0] / path.load[0] / RATIO)
        off_db[number, own], u_db[number, own] = 20 * np.log10(gains), (*path.u_db, path.cross_u_db)
    inside = np.where(np.isfinite(off_db), np.abs(off_db) <= NORMAL_95 * u_db, np.nan)
    rows = []
    for name, off, within in zip((*TRUE.frequency_hz, "cross over load"), off_db.T, inside.T, strict=True):
        if np.isfinite(off).any():
            rows.append({"gain": name, "found": int(np.isfinite(off).sum()), "bias_db": np.nanmean(off),
                         "scatter_db": np.nanstd(off), "covered": np.nanmean(within)})  # fmt: skip
    return {"rows": rows, "rigs": rigs}


def rough(rigs: int, progress: Progress) -> Row:
    """What rough rigs say of the locked power of the smooth scene behind the known path."""
    smooth = rough_run(Fault.OUTER)
    order = line_order(smooth, BEARING)
    model = locked_levels(behind(smooth, TRUE), BEARING, order)
    errors, reading = [], []
    for number in range(rigs):
        progress("rigs with waves", number / rigs)
        seed = FIRST_SEED + number
        run = rough_run(Fault.OUTER, WAVES_NM, seed)
        shown = behind(run, TRUE)
        noise = background(np.random.default_rng(seed), NOISE)
        rig = locked_levels(replace(shown, channels={"sensor": shown.channels["sensor"] + noise}), BEARING, order)
        errors.append([model[name].value - one.value if one.present else np.nan for name, one in rig.items()])
        reading.append([one.ci95 for one in rig.values()])
    known, off = np.split(np.array(errors), [rigs // 2])
    count = np.isfinite(known).sum(axis=0)
    scatter = np.nanstd(known, axis=0, ddof=1) * np.sqrt(1 + 1 / count) * t.ppf(0.975, count - 1)
    own, shown_off = np.array(reading[rigs // 2 :]), np.isfinite(off)
    inside = {"reading": np.abs(off) <= own, "with surfaces": np.abs(off) <= np.hypot(own, scatter)}
    columns = zip(model, shown_off.sum(axis=0), np.nanmean(off, axis=0), scatter, strict=True)
    return {
        "rows": [{"third octave": name, "shown": n, "bias_db": b, "U_surfaces_db": u} for name, n, b, u in columns],
        "waviness_nm": WAVES_NM, "rigs": rigs,
        "covered": {how: of[shown_off].mean() for how, of in inside.items()},
    }  # fmt: skip


def sizes(progress: Progress) -> Row:
    """Sizes found of each fault's defects, by its size and way of finding."""
    found = []
    inputs, positions = rig_inputs(), rig_inputs("position")
    drawn = draws(inputs, POWER, seed=TRUTH_SEED)[1:]
    for number, (state, rpm) in enumerate(CASES):
        own = {"defect": {"kind": state}, "shaft_speed": f"{rpm} rpm", "duration_s": SIZE_SECONDS}
        scene = load_scene("rig", own)
        asked = at_speed(rpm, "asked", state, np.zeros(scene.samples))
        others = [load_scene("rig", merge(own, one)) for one in draws((*inputs, *positions), POWER)]
        runs = size_runs(asked, scene, others)
        cases = list(itertools.product(EXTENTS_MM, PLACES))
        for place, ((extent_mm, (angle, axial)), one) in enumerate(zip(cases, drawn, strict=True)):
            progress(f"{state}, {rpm} rpm", (number + place / len(cases)) / len(CASES))
            hole = {"extent": f"{extent_mm} mm", "angle": f"{angle} deg", "axial": f"{axial} mm"}
            changed = merge(own, merge(one, {"defect": hole, "solver": {"step_s": STEP_S}}))
            run = simulate(load_scene("rig", changed), step=Step.UNCHECKED)
            shown = behind(run.require_usable(f"defect size: the run of the {state} fault"), TRUE).channels["sensor"]
            noise = background(np.random.default_rng([number, place]), SIZE_NOISE)[: shown.size]
            record = at_speed(rpm, "true", state, shown + noise)
            found.append((state, extent_mm, defect_size(record, runs, TRUE, bearing=BEARING)))
    return {"rows": list(counted(found)), "places": PLACES}


def at_speed(rpm: float, name: str, state: Fault, samples: np.ndarray) -> Recording:
    """A record at another speed."""
    speed = ShaftSpeed(value_hz=rpm / 60, ci95_hz=0.001, source=SpeedSource.TACHOMETER)
    return replace(record_of(name, state, samples), speed=speed)


def counted(found: list[tuple[Fault, float, DefectSize]]) -> Iterator[Row]:
    """Counts for each way of finding, by fault and size [mm] and over all of them."""
    kinds = [*dict.fromkeys((state, true) for state, true, _ in found), None]
    for way, kind in itertools.product(LEVEL_U_DB, kinds):
        pairs = [(true, one.sizes[way]) for state, true, one in found if kind in ((state, true), None)]
        ratio = np.array([1e3 * size.extent_m / true for true, size in pairs])
        ends = [(1e3 * (size.low_m or 0.0), 1e3 * (size.high_m or math.inf)) for _, size in pairs]
        covered = [low <= true <= high for (low, high), (true, _) in zip(ends, pairs, strict=True)]
        low_mm, high_mm = np.median(ends, axis=0).tolist()
        yield {
            "from": way, "fault": kind[0] if kind else "all", "true mm": kind[1] if kind else "all",
            "truths": len(pairs), "covered": sum(covered),
            "resolved": sum(low > 0 and high < math.inf for low, high in ends),
            "within 20 %": int(np.sum(np.abs(ratio - 1) <= NEAR)),
            "median mm": float(np.median([1e3 * size.extent_m for _, size in pairs])),
            "from mm": low_mm, "to mm": high_mm if high_mm < math.inf else None,
        }  # fmt: skip


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    runs = {
        "paths": lambda: paths(options.rigs or RIGS, progress),
        "rough": lambda: rough(options.rough_rigs or RIGS, progress),
        "sizes": lambda: sizes(progress),
    }  # fmt: skip
    content = {part: run() for part, run in runs.items() if options.part in (part, None)}
    texts = [
        f"{part}: {'; '.join(f'{key} {value}' for key, value in of.items() if key != 'rows')}\n{text_rows(of['rows'])}"
        for part, of in content.items()
    ]
    name = None if options.part else "simulated_truth"
    return StudyResult(name=name, content=content, text="\n\n".join(texts))
