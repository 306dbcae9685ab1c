"""Regression check: compare characteristic numbers of the program with a reference; find outdated stored results.

`PROBES` lists the parts of the program on which stored results of studies may depend. Each part has a probe: a
function that runs the part on bundled scenes or shipped recordings and returns some tens of numbers. The numbers of all
parts are the program's fingerprint. They are compared within a tolerance with the file ``reports/fingerprint.json``,
see `srbval.storage.stored_result`. A changed constant of a model changes the fingerprint, a renamed function does not.

If the rollers leave a radial play in the bearing, unloaded rollers rattle, and a small change of the motion grows. With
the point contacts of the model `full` it doubles every 0.3 ms, also in explicit solvers near their stability limit.
Such simulations last only 2.5 ms, other simulations with a play 12 ms: rounding errors, which differ between processors
with and without vector instructions, then stay below the tolerance.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from srbval import __version__
from srbval.bearing import DEFAULT_BEARING, DEFECTS, RACE_DEFECTS, Fault, load_bearing
from srbval.comparison.cage_means import cage_means
from srbval.comparison.cage_readings import cage_readings
from srbval.diagnosis.fault_verdict import diagnose
from srbval.models.hierarchy import LEVELS
from srbval.models.run import Run
from srbval.models.sensor import along_sensor, band_rms
from srbval.models.simulate import Step, simulate
from srbval.models.step_limits import predict
from srbval.path import amplitudes
from srbval.path.identify import Pair, identify
from srbval.plan.measures import measure
from srbval.plan.plan import refusal
from srbval.plan.questions import answer_questions, error_pct
from srbval.processes.machine import usable_cores
from srbval.progress import Progress, silent
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings import load_recording, recording_from_run
from srbval.scene import BANDS_HZ, Scene, load_scene
from srbval.scene.read import BUNDLED
from srbval.storage import stored_result
from srbval.storage.installation import git_revision, package_folder, shipped_folder
from srbval.storage.json_files import write_json
from srbval.storage.stored_result import Fingerprint, FingerprintValue, compare_part, read_result, reference_fingerprint
from srbval.storage.tables import read_toml
from srbval.sweep.scenes import FITS, PAPER, bench_scene, lasting_passages

ProbeOutputs = dict[str, FingerprintValue]
UNSTABLE_S, PLAY_S, SMOOTH_S = 0.0025, 0.012, 0.05  # simulated time of a probe, by how fast a small change grows
STATES = (Fault.HEALTHY, *DEFECTS)
PROBED_SOLVERS, SOLVER_STEP_S = ("ode1", "ode2", "ode4", "imex1"), 1 / 245760  # solvers besides the default
IMPULSE_S = 1.0  # duration of the run with which a path is identified
SLOW: dict[str, Any] = {"states": (Fault.OUTER,), "prefix": "slow ", "shaft_speed_rad_s": 340 * math.pi / 30}
# Changes of a scene so that its run answers all questions: no play, more than the eight turns that a reading needs.
ASKED_SCENE = {"duration_s": 0.7, "shaft_speed_rad_s": 997 * math.pi / 30, "contact": {"roller_fit": "printed"}}


def fingerprint(*parts: str, jobs: int | None = None, progress: Progress = silent) -> dict[str, ProbeOutputs]:
    """Run the program's `parts` (default: all) on examples; returns numbers by part and name. Takes about 20 s."""
    names, found = parts or tuple(PROBES), dict[str, ProbeOutputs]()
    with ThreadPoolExecutor(jobs or usable_cores()) as pool:
        for name, values in zip(names, pool.map(lambda name: PROBES[name](), names), strict=True):
            found[name] = values
            progress("probe the program's behaviour", len(found) / len(names))
    return found


def _probe_scenes(
    model: str, base: str, *, fits: Iterable[str] = ("play",), states: Iterable[Fault] = STATES, **changes: Any
) -> Iterator[tuple[str, Scene]]:
    """Yield names and short variants of the bundled scene `base`, one for each roller fit and bearing state.

    `fits` are rules for the roller diameter (see `RollerFit`); `changes` are further changes of the scene, by key.
    """
    for fit, state in itertools.product(fits, states):
        own = {"model": model, "duration_s": PLAY_S if fit == "play" else SMOOTH_S, "settle_s": 0.0}
        own |= {"contact": {"roller_fit": fit}, "defect": {"kind": state.scene_word}}
        yield f"{base} {fit} {state}", load_scene(base, own | changes)


def _numbers_of_run(run: Run) -> ProbeOutputs:
    """Return the quantities of a run that the regression check compares, by name."""
    along, fs_hz = along_sensor(run.acceleration_m_s2), run.scene.output_rate_hz
    found: ProbeOutputs = {
        "status": run.status.value,
        "cage_ratio": run.cage_ratio,
        "load_share": run.roller_load_share,
        "drive_power_w": run.drive_power_w,
        "ring_y_m": float(run.displacement_m[:, 1].mean()),
        "sensor_rms_m_s2": float(along.std()),
        "axial_rms_m_s2": float(run.acceleration_m_s2[:, 2].std()),
        "across_rms_m_s2": float(run.acceleration_m_s2[:, 0].std()),
    }
    found |= {f"rms {name} Hz_m_s2": band_rms(along, fs_hz, band_hz) for name, band_hz in BANDS_HZ.items()}
    estimates = run.step_error.estimates if run.step_error else ()
    return found | {f"step error of {one.of}": round(one.error, 9) for one in estimates}


def _probe_model(
    model: str, base: str, *, prefix: str = "", step: Step = Step.UNCHECKED, **options: Any
) -> ProbeOutputs:
    """Simulate all scenes that `_probe_scenes` yields for these arguments; return the numbers that are compared."""
    return {
        f"{prefix}{name}: {quantity}": value
        for name, scene in _probe_scenes(model, base, **options)
        for quantity, value in _numbers_of_run(simulate(scene, step=step)).items()
    }


def _probe_full() -> ProbeOutputs:
    """Compute regression-check numbers of the point-cloud model, for two roller diameters and several solvers."""
    found = _probe_model("full", "paper", duration_s=UNSTABLE_S) | _probe_model("full", "paper", fits=("printed",))
    printed: dict[str, Any] = {"fits": ("printed",)}
    for name in PROBED_SOLVERS:
        own = printed | {"states": (Fault.OUTER,), "duration_s": UNSTABLE_S, "prefix": f"{name} "}
        found |= _probe_model("full", "paper", solver={"name": name, "step_s": SOLVER_STEP_S}, **own)
    own = printed | {"states": (Fault.INNER,), "prefix": "checked ", "step": Step.CHECKED}
    return found | _probe_model("full", "paper", **own)


@cache
def _analyse_shipped() -> tuple[Analysis, ...]:
    """Analyse the recordings shipped with srbval."""
    files = sorted((shipped_folder("data_manifest") / "rig_excerpts").glob("*.h5"))
    return tuple(analyse(load_recording(path), bearing=load_bearing(DEFAULT_BEARING)) for path in files)


def _probe_reading() -> ProbeOutputs:
    """Compute values for the regression check: lines detected in the shipped recordings, and their frequencies."""
    found: ProbeOutputs = {}
    for analysis in _analyse_shipped():
        record = analysis.recording.name
        for line in (one for one in analysis.lines if one.harmonic == 1):
            read: dict[str, Any] = {"detected": str(line.detected), "kinematic_hz": line.kinematic_hz}
            if line.detected:
                read |= {"hz": line.found_hz, "ci95_hz": line.ci95_hz, "snr": line.snr, "p": line.false_alarm}
            found |= {f"{record} {line.name}: {key}": math.nan if one is None else one for key, one in read.items()}
        found[f"{record}: shaft_hz"] = analysis.speed.value_hz
    return found


def _probe_diagnosis() -> ProbeOutputs:
    """Compute regression-check numbers of the diagnosis: state and probabilities for every shipped recording."""
    found: ProbeOutputs = {}
    for analysis in _analyse_shipped():
        made = diagnose(analysis)
        found[f"{analysis.recording.name}: called"] = made.state
        found |= {f"{analysis.recording.name}: {name}_p": share for name, share in made.probabilities.items()}
    return found


def _probe_path() -> ProbeOutputs:
    """Compute values for the regression check: levels of shipped recordings, and gains of the path to the sensor."""
    bearing, found = load_bearing(DEFAULT_BEARING), ProbeOutputs()
    for analysis in _analyse_shipped():
        record, state = analysis.recording, analysis.recording.state
        if state not in RACE_DEFECTS:
            continue
        order = bearing.orders.bpfo if state is Fault.OUTER else bearing.orders.bpfi
        read = amplitudes.levels(record, None) | amplitudes.locked_levels(record, bearing, order)
        read |= amplitudes.pattern(record, bearing, state, order)
        found |= {f"{record.name}: {name}_db": one.value for name, one in read.items()}
    record = next(one.recording for one in _analyse_shipped() if one.recording.name.startswith("OR_877"))
    changes = {"model": "impulse", "duration_s": IMPULSE_S, "defect": {"kind": "outer"}}
    made = identify(Pair(record=record, run=simulate(load_scene("rig", changes))), bearing=bearing)
    gains = zip(made.path.frequency_hz, made.path.load, strict=True)
    return found | {f"path {hz:.0f} Hz: gain": float(f"{gain:.9g}") for hz, gain in gains}


def _probe_comparison() -> ProbeOutputs:
    """Compute values for the regression check: cage / shaft speed in recordings, and checksums of two input files."""
    recordings, found = [one.recording for one in _analyse_shipped()], ProbeOutputs()
    readings = cage_readings(recordings, load_bearing(DEFAULT_BEARING))
    for one in readings:
        found |= {f"{one.record}: ratio": one.ratio, f"{one.record}: u": one.reading_u}
    means = cage_means(readings)
    found |= {f"mean at {rpm:g} rpm": float(mean) for rpm, mean in zip(means.rpm, means.means, strict=True)}
    found |= {f"spread at {rpm:g} rpm": float(of.std()) for rpm, of in zip(means.rpm, means.draws.T, strict=True)}
    return found | _checksum("comparison/budget.toml") | _checksum("scene/rig_inputs.toml")


def _probe_plan() -> ProbeOutputs:
    """Compute values for the regression check: answers of models and their errors; scenes for comparing solvers.

    For these scenes the longest stable steps are predicted (0: with friction, 1: without).
    """
    bearing, found = load_bearing(DEFAULT_BEARING), dict[str, FingerprintValue | None]()

    def asked_run(model: str, state: Fault) -> Run:
        return simulate(load_scene("paper", ASKED_SCENE | {"model": model, "defect": {"kind": state.scene_word}}))

    healthy = recording_from_run(asked_run("planar", Fault.HEALTHY))
    for state in RACE_DEFECTS:
        right = asked_run("line", state)
        own, of_right = (answer_questions(run, bearing, healthy) for run in (asked_run("planar", state), right))
        for question, answer in of_right.items():
            found |= {f"{state} {question}: {number}": value for number, value in enumerate(answer or ())}
            found[f"{state} {question}: error_pct"] = error_pct(question, own[question], answer)
        found |= {f"{state}: {name}": value for name, value in measure(right).items()}
    for name in (f"{fit}-{Fault.OUTER}" for fit in FITS):
        scene = bench_scene(name, solver=PAPER.solver, step_s=PAPER.step_s)
        scene = lasting_passages(scene, 10.0, least_s=0.01, settle=1.0)
        found |= {f"{name}: {key}": getattr(scene, key) for key in ("duration_s", "settle_s", "output_rate_hz")}
        for solver, limits in predict(scene, ("ode4", "imex2")).items():
            found |= {f"{name} {solver}: step limit {i}_s": limit for i, limit in enumerate(limits)}
    for base in BUNDLED:
        scene = load_scene(base)
        why = {level.name: refusal(level, scene, load_bearing(scene.bearing)) for level in LEVELS}
        found |= {f"{base} {model}: runs": str(reason is None) for model, reason in why.items()}
    found |= _checksum("sweep/paper_integration.toml")
    return {name: math.nan if value is None else value for name, value in found.items()}


def _checksum(file: str) -> ProbeOutputs:
    """Number of the numbers in a TOML file of the package, and a sum that depends on their values and order."""
    numbers = _numbers_in(read_toml(package_folder() / file))
    weighted = float(np.dot(numbers, np.sqrt(np.arange(1, len(numbers) + 1))))
    return {f"{file}: numbers": len(numbers), f"{file}: sum": weighted}


def _numbers_in(value: Any) -> list[float]:
    """List every number of a nested table, in order."""
    if isinstance(value, int | float):
        return [float(value)]
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return [number for one in inner for number in _numbers_in(one)]


PROBES: Mapping[str, Callable[[], ProbeOutputs]] = {
    "full": _probe_full,
    "slices": lambda: _probe_model("slices", "rig") | _probe_model("slices", "rig", **SLOW),
    "line": lambda: _probe_model("line", "paper", fits=("play", "printed"), states=(Fault.HEALTHY, *RACE_DEFECTS)),
    "planar": lambda: _probe_model("planar", "paper"),
    "impulse": lambda: _probe_model("impulse", "paper") | _probe_model("kinematic", "paper"),
    "oil": lambda: _probe_model("slices", "rig-oil", states=(Fault.HEALTHY,)),
    "reading": _probe_reading,
    "diagnosis": _probe_diagnosis,
    "path": _probe_path,
    "plan": _probe_plan,
    "comparison": _probe_comparison,
}
"""Function that probes each part of the program, by the name of the part."""


def run_check(now: Fingerprint | None = None, *, progress: Progress = silent) -> dict[str, Any]:
    """Compare every part of the program with reference values, and list outdated stored results.

    `now` is the program's `fingerprint`; by default it is computed. In the returned mapping, `checks` lists every
    number as in `compare_part`, `stale` the `file` of each outdated result and `why`; `ok` is true if every number
    agrees and no result is outdated. Raises the errors of running a bundled scene and of reading a shipped recording.
    """
    known, now = reference_fingerprint(), now or fingerprint(progress=progress)
    checks = [
        one | {"name": f"{part}: {one['name']}"}
        for part, values in now.items()
        for one in compare_part(values, known.get(part, {}))
    ]
    shipped = map(read_result, sorted(shipped_folder(stored_result.REPORTS).glob("*.json")))
    stale = [{"file": one.path.name, "why": why} for one in shipped if one and (why := one.why_stale(now))]
    return {"checks": checks, "stale": stale, "ok": not stale and all(one["ok"] for one in checks)}


def reference_path() -> Path:
    """Path of the regression check's reference values, in the repository or in the installed package."""
    return shipped_folder(stored_result.REPORTS) / stored_result.REFERENCE_FILE


def write_reference(now: Fingerprint) -> None:
    """Store `now` as the regression check's reference."""
    origin = stored_result.REFERENCE_ORIGIN | {"srbval": __version__, "git_revision": git_revision()}
    write_json(reference_path(), origin | {"parts": now})
    reference_fingerprint.cache_clear()
