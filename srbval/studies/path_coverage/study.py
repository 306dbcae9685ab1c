"""Bias and coverage of identified paths on simulated truth.

Rigs of one known path, each with pulses, slip and noise of its own, through `identify`; the path's level in third
octaves against the true one and its 95 % interval, by Student's factor for what the bands leave over. A rig's third
octaves share its errors, so that the count's own standard error is taken over rigs.

With ``--waviness-nm`` the rigs are runs of the scene `rig` with waves of that height, others on the faulty bearing than
on the healthy one. The path is known there; what the smooth scene shows behind it is held against each rig's increment.
How far surfaces scatter it, half of the rigs tell; judged are the others, and how many of them reject the true path,
one with its modes a tenth off, one without modes, and a hole 1.5 times as small or large, at one in a hundred.
"""

from argparse import ArgumentParser, Namespace
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import stdtrit

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.models.band_levels import along_sensor
from srbval.models.sensor_filter import SensorFilter
from srbval.models.simulate import Step, simulate
from srbval.path.amplitudes import THIRD_OCTAVES, levels
from srbval.path.identify import BAND_HZ, band_powers, identify
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.recordings import Recording
from srbval.scene import load_scene
from srbval.studies.harness import Study, StudyResult
from srbval.studies.simulated_rig import BEARING, FS_HZ, SECONDS, SHAFT_HZ, TRUE, background, record, simulated_rig

MOVED = replace(TRUE, modes=tuple(replace(mode, frequency_hz=1.1 * mode.frequency_hz) for mode in TRUE.modes))
REJECTED, OFTEN, SIZES = 0.01, 0.9, (1.0, 2 / 3, 1.5)
THIRD_OCTAVES_HZ = 10 ** (np.arange(27, 35) / 10)  # 500 to 2500 Hz, wholly within the band of the fit


def ring(state: Fault, nm: float = 0.0, seed: int = 0, size: float = 1.0) -> FloatArray:
    """Accelerations of the rig scene's ring with waves of that height, its hole `size` times as large."""
    changes = {"defect": {"kind": state, "extent_m": size * 2e-3}, "shaft_speed": f"{60 * SHAFT_HZ} rpm",
               "duration": f"{SECONDS} s", "seed": seed}  # fmt: skip
    if nm:
        changes["surface"] = {f"{body}_waviness_m": nm * 1e-9 for body in ("outer", "inner", "roller")}
    run = simulate(load_scene("rig", changes), step=Step.UNCHECKED)
    assert run.status.usable, run.reason
    return along_sensor(run.acceleration_m_s2)


def rough(rigs: int, first_seed: int, nm: float, noise: float) -> StudyResult:
    """What rough rigs say of the increments of the smooth scene behind the known path."""
    smooth = {size: record("smooth", Fault.OUTER, ring(Fault.OUTER, size=size)) for size in SIZES}
    model = levels(behind(smooth[1.0], np.random.default_rng(0), 0.0), None)
    errors, reading, evidence = [], [], []
    for seed in range(first_seed, first_seed + rigs):
        random = np.random.default_rng(seed)
        fault, healthy = (behind(record("rough", state, ring(state, nm, 2 * seed + i)), random, noise)
                          for i, state in enumerate((Fault.OUTER, Fault.HEALTHY)))  # fmt: skip
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
    rows = [{"third octave": name, "shown": n, "bias_db": bias, "U_surfaces_db": u} for name, n, bias, u in columns]
    bias = np.nanmean(off[:, often], axis=1)
    shown_off = np.isfinite(off[:, often])
    covered = {how: float(of[:, often][shown_off].mean()) for how, of in inside.items()}
    first = [one[1.0] for one in evidence[: rigs // 2]]
    tau = brentq(lambda db: np.median([one.chance(TRUE, db) for one in first]) - 0.5, 0.1, 20)
    asked = {"true": (1.0, TRUE), "modes 10 % off": (1.0, MOVED), "no modes": (1.0, replace(TRUE, modes=()))}
    asked |= {f"hole times {size:.2g}": (size, TRUE) for size in SIZES[1:]}
    rejected = [
        {"path": name, "rejected": sum(one[size].chance(path, tau) < REJECTED for one in evidence[rigs // 2 :]),
         "of": len(evidence) - rigs // 2}
        for name, (size, path) in asked.items()
    ]  # fmt: skip
    content = {
        "waviness_nm": nm, "rigs": rigs, "bias_db": float(bias.mean()), "covered": covered, "scatter_db": float(tau),
        "bias_u_db": float(bias.std() / np.sqrt(bias.size - 1)), "rows": rows, "rejected": rejected,
    }  # fmt: skip
    text = (
        f"{text_rows(rows)}\nshown by {OFTEN:.0%} of rigs: bias {content['bias_db']:+.2f} +- {content['bias_u_db']:.2f}"
        f" dB, covered {covered}, scatter {tau:.1f} dB\n{text_rows(rejected)}"
    )
    return StudyResult(name="path_coverage_rough", content=content, text=text)


def behind(run: Recording, random: np.random.Generator, noise: float) -> Recording:
    """What the sensor shows of it, with noise."""
    shown = SensorFilter(TRUE, FS_HZ).add(run.channels["a"])
    return replace(run, channels={"a": shown + background(random, noise)})


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--rigs", metavar="N", type="count", default=100, help="simulated rigs (default: 100)")
    parser.add_argument("--first-seed", metavar="N", type="seed", default=3000, help="of the first rig (default: 3000)")
    parser.add_argument("--noise", metavar="X", type="positive", default=0.05, help="background [m/s2] (default: 0.05)")
    parser.add_argument("--missed-db", metavar="DB", type="positive", default=1.5, help="what the model misses")
    parser.add_argument("--waviness-nm", metavar="NM", type="positive", help="rigs are runs with waves of this height")


def _run(options: Namespace, progress: Progress) -> StudyResult:
    if options.waviness_nm:
        return rough(options.rigs, options.first_seed, options.waviness_nm, options.noise)
    errors, inside, modes = [], [], []
    truth, _ = TRUE.level_db(THIRD_OCTAVES_HZ)
    for seed in range(options.first_seed, options.first_seed + options.rigs):
        progress("identify the paths of simulated rigs", (seed - options.first_seed) / options.rigs)
        rig = simulated_rig(seed, noise=options.noise, missed_db=options.missed_db)
        found = identify(rig.fault, rig.healthy, rig.excitation, bearing=BEARING)
        level, u = found.path.level_db(THIRD_OCTAVES_HZ)
        assert found.levels_db is not None
        spare = len(found.levels_db) - 2 - 3 * len(found.path.modes)
        errors.append(level - truth)
        inside.append(np.abs(level - truth) <= stdtrit(spare, 0.975) * u)
        modes.append(len(found.path.modes))
    progress("identify the paths of simulated rigs", 1.0)
    columns = zip(
        THIRD_OCTAVES_HZ, np.mean(errors, axis=0), np.std(errors, axis=0), np.mean(inside, axis=0), strict=True
    )
    rows = [{"hz": hz, "bias_db": b, "scatter_db": s, "covered": c} for hz, b, s, c in columns]
    share = np.mean(inside, axis=1)
    content = {
        "rigs": options.rigs, "rows": rows, "bias_db": float(np.mean(errors)), "covered": float(share.mean()),
        "covered_u": float(np.std(share, ddof=1) / np.sqrt(len(share))), "modes": np.bincount(modes).tolist(),
    }  # fmt: skip
    whole = "all: bias {bias_db:+.2f} dB, covered {covered:.3f} +- {covered_u:.3f}; modes {modes}".format(**content)
    return StudyResult(name="path_coverage", content=content, text=f"{text_rows(rows)}\n{whole}")


STUDY = Study(
    question="How biased are identified paths, and do their intervals cover the truth?", minutes=6, run=_run,
    options=_options,
)  # fmt: skip
