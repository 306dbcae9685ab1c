"""Run a scene: choose the model, integrate in chunks, judge the result."""

from __future__ import annotations

import difflib
import time
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from srbval.bearing import Bearing, load_bearing
from srbval.errors import ConfigurationError
from srbval.models.run import Run, RunStatus
from srbval.scene import Scene

MODELS = ("full",)
CHUNK_S = 0.02  # simulated time between two signs of progress


def simulate(scene: Scene, *, progress: Callable[[float], None] | None = None) -> Run:
    """Run `scene` from its rolling start; `progress` is told the simulated seconds done, settling included.

    Raises `ConfigurationError` for an unknown model or solver or a bearing without geometry. A failed run
    is returned, not raised: its `status` says so and its `reason` says what to do.
    """
    bearing = load_bearing(scene.bearing)
    _check_known("model", scene.model, MODELS)
    return _simulate_full(scene, bearing, progress or (lambda _: None))


def _check_known(what: str, name: str, known: Iterable[str]) -> None:
    known = tuple(known)
    if name not in known:
        close = difflib.get_close_matches(name, known, n=1, cutoff=0.4)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        raise ConfigurationError(f"{what} {name!r} is not known.{hint} Known: {', '.join(known)}.")


def _simulate_full(scene: Scene, bearing: Bearing, progress: Callable[[float], None]) -> Run:
    from srbval.models.full.explicit_kernel import OUTPUTS, advance
    from srbval.models.full.parameters import make_parameters
    from srbval.models.full.start import rolling_state
    from srbval.models.solvers import TABLEAUX

    _check_known("solver", scene.solver.name, TABLEAUX)
    if bearing.geometry is None:
        raise ConfigurationError(f"bearing {bearing.name!r} has no [geometry]; the full model cannot run it.")
    tableau = TABLEAUX[scene.solver.name]
    model = make_parameters(scene, bearing.geometry)
    state = rolling_state(model)
    per_output = scene.steps_per_output
    step = 1 / (scene.output_rate_hz * per_output)

    def integrate(out: np.ndarray, done: int) -> None:
        advance(state, done * per_output, step, per_output, tableau.a, tableau.b, tableau.c, model, out)

    started = time.perf_counter()
    integrate(np.empty((0, OUTPUTS)), 0)
    compile_s = time.perf_counter() - started

    settle = round(scene.settle_s * scene.output_rate_hz)
    out = np.empty((settle + scene.samples, OUTPUTS))
    chunk = max(1, round(CHUNK_S * scene.output_rate_hz))
    started = time.perf_counter()
    for first in range(0, len(out), chunk):
        part = out[first : first + chunk]
        integrate(part, first)
        progress((first + len(part)) / scene.output_rate_hz)
        if not np.all(np.isfinite(state)):
            out = out[: first + len(part)]
            break
    wall_s = time.perf_counter() - started
    return _finish(scene, bearing, out[settle:] if len(out) > settle else out, wall_s, compile_s)


def _finish(scene: Scene, bearing: Bearing, out: np.ndarray, wall_s: float, compile_s: float) -> Run:
    from srbval.models.full.point_cloud import DEEPEST_M
    from srbval.models.health import judge

    run = Run(
        scene=scene,
        rolling_elements=bearing.rolling_elements,
        status=RunStatus.OK,
        reason="",
        acceleration_m_s2=np.ascontiguousarray(out[:, 0:3]),
        displacement_m=np.ascontiguousarray(out[:, 3:6]),
        cage_rad_s=out[:, 6].copy(),
        cage_tilt_rad=np.ascontiguousarray(out[:, 7:9]),
        roller_force_n=np.ascontiguousarray(out[:, 9:12]),
        depth_m=out[:, 12].copy(),
        wall_s=wall_s,
        compile_s=compile_s,
    )
    finite = bool(np.all(np.isfinite(out)))
    status, reason = judge(scene, run.cage_ratio, run.roller_load_share, run.depth_m, DEEPEST_M, finite)
    return replace(run, status=status, reason=reason)
