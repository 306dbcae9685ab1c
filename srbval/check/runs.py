"""Runs and static balances that quantities are taken from."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from srbval.bearing import Fault, load_bearing
from srbval.bench.measures import measure
from srbval.errors import ConfigurationError
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.parameters import make_parameters
from srbval.models.precompile import load_kernels
from srbval.models.run import Run, RunStatus
from srbval.models.run_statistics import RunStatistics
from srbval.models.simulate import simulate, static_share
from srbval.progress import Progress
from srbval.recordings import recording_from_run
from srbval.scene import RollerFit, Scene
from srbval.validation.analyse import analyse

Values = Mapping[str, float | None]

SECONDS = 2.0
"""Recorded: long enough to read a line to 0.05 Hz, short enough for a check to be made often."""


def printed(base: Scene) -> Scene:
    """The same with the roller diameter printed in Table 1: every roller is loaded, nothing rattles."""
    return replace(base, contact=replace(base.contact, roller_fit=RollerFit.PRINTED))


def with_defect(base: Scene, kind: Fault) -> Scene:
    """The same, `SECONDS` long, with a defect of that kind."""
    return replace(base, defect=replace(base.defect, kind=kind), duration_s=SECONDS)


def run_side_by_side(scenes: Mapping[str, Scene], progress: Progress) -> dict[str, Run | None]:
    """Run every scene, one per core at a time; None where a run failed or found no start."""

    def one(name: str) -> Run | None:
        scene = scenes[name]
        try:
            run = simulate(scene, progress=lambda _, fraction: progress(name, fraction))
        except ConfigurationError:  # the reference scenes are valid: the model is at fault
            return None
        return run if run.status is RunStatus.OK else None

    load_kernels(scene.model for scene in scenes.values())
    with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:
        return dict(zip(scenes, pool.map(one, scenes), strict=True))


def measures_of(run: Run | None) -> dict[str, float]:
    """Cage, load, slip power and vibration of a run; NaN throughout where it failed."""
    if run is None:
        return dict.fromkeys(("cage_ratio", "roller_load_share", "slip_power_w", "band_rms_m_s2"), math.nan)
    measured = measure(run)
    return {
        "cage_ratio": measured.cage_ratio,
        "roller_load_share": run.roller_load_share,
        "slip_power_w": float(run.energy.friction_w.mean()),
        "band_rms_m_s2": measured.band_rms_m_s2,
    }


def read_line(run: Run | None, name: str) -> float:
    """A fault line as the pipeline reads it from a run [Hz]; NaN where the run failed or it is not found."""
    if run is None:
        return math.nan
    found = analyse(recording_from_run(run), bearing=load_bearing(run.scene.bearing)).line(name).found_hz
    return math.nan if found is None else float(found)


def balance(scene: Scene) -> dict[str, float]:
    """Static balance: ring displacement along y [um] and the rollers' part of the load; NaN where there is none."""
    bearing = load_bearing(scene.bearing)
    if bearing.geometry is None:
        raise ConfigurationError(f"bearing {bearing.name!r} has no [geometry]; it has no static balance.")
    load_kernels([scene.model])
    model = make_parameters(scene, bearing.geometry)
    try:
        state = equilibrium_state(model).state
    except ConfigurationError:  # the reference scenes have one: the model is at fault
        return {"ring_um": math.nan, "roller_share": math.nan}
    ring = state[len(state) // 2 - 3 : len(state) // 2]
    share = static_share(RunStatistics(scene=scene, bearing=bearing), model, ring)
    return {"ring_um": float(ring[1]) * 1e6, "roller_share": share}
