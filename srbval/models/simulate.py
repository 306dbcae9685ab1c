"""Simulates a scene with its model in chunks and assesses the run, in memory or directly into a file.

A stored run, from the user's cache, equals a new run of the same code on this machine bit for bit, except for its
times, see `RunSummary.stored_utc`. Runs that are not usable or are too large are not stored.
"""

import contextlib
import enum
import math
import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np

from srbval.bearing import load_bearing
from srbval.errors import ConfigurationError, NumericsError
from srbval.models import outputs as col
from srbval.models.health import default_solver
from srbval.models.hierarchy import STEP_CHECK, check_known, geometry_of, level_of
from srbval.models.jit import WITHOUT_KERNELS, expected_compile_s, machine, missing_kernels, precompile
from srbval.models.outputs import Outputs
from srbval.models.outside.names import OWN_SOLVER, content_of, solvers_of
from srbval.models.run import Run, RunSummary
from srbval.models.run_file import RunWriter, read_run_file, read_summary, scene_content, write_run
from srbval.models.run_statistics import RunStatistics
from srbval.models.solvers import METHODS
from srbval.progress import Progress, silent, stage
from srbval.scene import Scene, load_scene, paper_scene
from srbval.storage.content_store import LARGEST_BYTES, ContentStore
from srbval.storage.files import atomic_write, check_suffix
from srbval.storage.hdf5_files import HDF5, new_hdf5
from srbval.storage.sources import content_version

COPIES = 3  # copies of the signals in memory while they are joined
RUNS = ContentStore(kind="run", computed_by=__name__, suffix=".h5")


class Step(enum.StrEnum):
    """Treatment of the solver's step in a run, see `step_error`.

    `CHECKED`: the error due to the scene's step is estimated; `AUTO`: a step with an error within tolerance is chosen;
    `UNCHECKED`: neither, for runs that are timed or only compared.
    """

    CHECKED = "checked"
    AUTO = "auto"
    UNCHECKED = "unchecked"


def simulate(scene: Scene | str | Path, *, step: Step = Step.CHECKED, progress: Progress = silent) -> Run:
    """Simulate `scene` (or its name or file) from static balance and return the run with its signals.

    The error due to the step is estimated first, or a step is chosen, see `Step`. Raises `ConfigurationError` for an
    unknown model or solver, a bearing without geometry, or a load too high for the contacts. A failed run is returned,
    with the failure in `status` and `reason`; a run that diverges ends early.
    """
    stats = _prepare_run(scene if isinstance(scene, Scene) else load_scene(scene), step, progress)
    with np.errstate(all="ignore"):  # a state that is no longer finite is a status of the run
        parts = list(_recorded_chunks(stats, progress))
    names = Outputs.__dataclass_fields__
    joined: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return Run(**vars(stats.summary()), **joined)


def simulate_to_file(scene: Scene, path: Path, *, step: Step = Step.CHECKED, progress: Progress = silent) -> RunSummary:
    """Simulate `scene` like `simulate` and write its signals to `path` in chunks; an unusable run leaves no file.

    Raises `DataError` if the file cannot be written, `ConfigurationError` if its name has no suffix of an HDF5 file.
    """
    check_suffix(path, *HDF5)
    stats = _prepare_run(scene, step, progress, to_file=True)
    with contextlib.suppress(NumericsError), np.errstate(all="ignore"), new_hdf5(path) as file:
        writer = RunWriter(file, stats.scene)
        for part in _recorded_chunks(stats, progress):
            writer.append(part)
        writer.finish(stats.summary().require_usable("the run"))
    return stats.summary()


def compile_for(*scenes: Scene, jobs: int | None = None, progress: Progress = silent) -> float:
    """Compile the functions that simulations of `scenes` need; returns the time it took [s]."""
    own = [scene for scene in scenes if not level_of(scene.model).outside]
    if not missing_kernels(*own):
        return 0.0
    with stage(progress, f"Compile the models, once for all runs (about {expected_compile_s(*own):.0f} s)"):
        return precompile(*own, jobs=jobs)


def scenes_of_all_kernels() -> list[Scene]:
    """Scenes (inputs of simulations) that together run every function compiled by numba, for example every solver."""
    rig: tuple[dict[str, Any], ...] = {}, {"model": "full"}, {"bodies": {"free_rollers": True, "cages": 1}}
    own = [paper_scene(solver={"name": name}) for name in METHODS]
    own += [paper_scene(model=model) for model in ("slices", "line", "planar")]
    return [*own, *(load_scene("rig", changes) for changes in rig), load_scene("rig-oil")]


def _with_outside_solver(scene: Scene) -> Scene:
    """If a model from outside lacks the scene's solver, and this is the default solver, take the model's first solver.

    Raises `ConfigurationError` for any other solver that the model lacks, `DataError` if the model's files are missing.
    """
    if not level_of(scene.model).outside:
        return scene
    content_of(scene.model)
    offered, name = solvers_of(scene.model) or (OWN_SOLVER,), scene.solver.name
    if name == default_solver() and name not in offered:
        name = offered[0]
    check_known(f"{scene.model}: the solver", name, offered)
    return replace(scene, solver=replace(scene.solver, name=name))


def _prepare_run(scene: Scene, step: Step, progress: Progress, *, to_file: bool = False) -> RunStatistics:
    """Check scene and memory, compile, check or choose the step (see `Step`); returns the still empty statistics."""
    level, scene = level_of(scene.model), _with_outside_solver(scene)
    stats = RunStatistics(scene=scene, bearing=load_bearing(scene.bearing))
    level.check_scene(scene)
    if level.parameters is not None:
        check_known("solver", scene.solver.name, tuple(METHODS))  # before kernels are compiled
        geometry_of(stats.bearing, scene.model)
    check_room(stats, to_file=to_file)
    stats.compile_s = compile_for(scene, progress=progress)
    if step is not Step.UNCHECKED and level.parameters is not None:
        resolve_name(STEP_CHECK)(stats, choose=step is Step.AUTO)
    return stats


def check_room(stats: RunStatistics, *, to_file: bool) -> None:
    """Raise `ConfigurationError` if the run does not fit into memory; `to_file`: its signals are written to a file."""
    scene, samples, row = stats.scene, stats.scene.samples, 8 * col.COLUMN_COUNT
    details = samples // (scene.outputs_per_detail or math.inf) * stats.bearing.rolling_elements * 14 * 8
    needed = 16 * samples if to_file else COPIES * (samples * row + details)  # beside a file, only the time axis
    if scene.model in WITHOUT_KERNELS:  # models that are computed at once
        needed += COPIES * row * (samples + round(scene.settle_s * scene.output_rate_hz))
    try:
        there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # unknown
        return
    if needed > there:
        raise ConfigurationError(
            f"{scene.duration_s:g} s at {scene.output_rate_hz:g} Hz need {needed / 1e9:.3g} GB of memory, there are "
            f"{there / 1e9:.3g} GB: shorten the run, lower output rates{'' if to_file else ', or use -o FILE'}."
        )


def _recorded_chunks(stats: RunStatistics, progress: Progress) -> Iterator[Outputs]:
    """Run the scene's model, add each recorded chunk to `stats`, and yield the chunk."""
    scene = stats.scene
    if level_of(scene.model).outside:  # reports no progress
        progress("Simulate", None)
    settle = round(scene.settle_s * scene.output_rate_hz)
    whole = settle + scene.samples
    for first, steps in level_of(scene.model).run(stats, settle, whole):
        progress("Simulate", (first + len(steps.out)) / whole)
        diverged = stats.has_diverged(steps.out)
        if first >= settle or diverged:
            sensor_m_s2 = stats.add(steps.out)
            yield steps if scene.sensor_path is None else replace(steps, sensor_m_s2=sensor_m_s2)
        if diverged:
            return


def run_content(scene: Scene, step: Step = Step.UNCHECKED) -> str:
    """Text that identifies a run: hash of source code, `step`, default solver, processor, libraries, scene, bearing.

    The last digits of results depend on the processor and on the versions of numba and NumPy, and rattling rollers
    amplify these differences.
    """
    version = content_version(*level_of(scene.model).modules, lazy=False)
    return f"{version} {step} {default_solver()} {machine()} {scene.bearing} {scene_content(scene)}"


def stored_run(scene: Scene, *, step: Step = Step.CHECKED, progress: Progress = silent) -> Run:
    """Read the stored run of a scene, or simulate the scene and store the run."""
    scene = _with_outside_solver(scene)
    content = run_content(scene, step)
    found = RUNS.load(content, lambda table: read_run_file(RUNS.path(content), read_summary(table, scene)))
    if found is None:
        found = simulate(scene, step=step, progress=progress)
        _store(found, content, partial(write_run, found))
    return found


def stored_summary(
    scene: Scene, output: Path | None, *, step: Step = Step.CHECKED, progress: Progress = silent
) -> RunSummary:
    """Summary of a stored or new run, see `stored_run`; its signals are written to the file `output`, if not None."""
    scene = _with_outside_solver(scene)
    content = run_content(scene, step)
    found = RUNS.load(content, partial(read_summary, scene=scene))
    if output is None:
        return found or stored_run(scene, step=step, progress=progress)
    check_suffix(output, *HDF5)
    if found is not None:
        with contextlib.suppress(FileNotFoundError):  # if the stored file has been removed
            _copy(RUNS.path(content), output)
            return found
    found = simulate_to_file(scene, output, step=step, progress=progress)
    _store(found, content, partial(_copy, output))
    return found


def _store(run: RunSummary, content: str, write: Callable[[Path], None]) -> None:
    """Store a run by calling `write` with a path, if the run is usable and not too large."""
    if run.status.usable and run.samples * col.COLUMN_COUNT * np.dtype(float).itemsize < LARGEST_BYTES:
        RUNS.keep(content, write)


def _copy(path: Path, to: Path) -> None:
    with path.open("rb") as source, atomic_write(to) as part, part.open("wb") as copied:
        shutil.copyfileobj(source, copied)
