"""The rig scene at records' speeds: runs, drawn paths, backgrounds, rows of the comparison, scores."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.comparison.compared_quantities import CAGE_RATIO
from srbval.comparison.comparison import RIG_READING, Comparison, QuantityValue
from srbval.errors import DataError, NumericsError
from srbval.models.run import Run
from srbval.models.simulate import Step, simulate
from srbval.path.amplitudes import MARGIN
from srbval.reading.pipeline import one_signal
from srbval.recordings import Recording
from srbval.recordings.datasets.srbval_files import SENSOR
from srbval.recordings.registry import RegisteredRecording, find_recording, load_entry
from srbval.scene import SensorPath, load_scene, merge
from srbval.signal import phase_randomised

BEARING = load_bearing(DEFAULT_BEARING)
SECONDS = 2.0  # of a run, as of the records: 28 turns of the shaft, 200 or more passages
STEP_S = 1 / 61_440  # with the longest contacts the scene's own is beyond the stiffest roller's limit
FINER = {"solver": {"step_s": STEP_S / 2}, "line_contact": {"slices": 31}}
PATH_DRAWS, SEED = 24, 23
# A height chosen once, by H 877's level with Table 4's damper on the ring; now it is too much: see `theory/surface.md`.
WAVES = {"surface": {f"{body}_waviness": "28 nm" for body in ("outer", "inner", "roller")}}
FAST, SLOW = 877.0, 353.0  # nominal rpm
DIRECTION = "IR_877rpm_sample"  # whose sidebands gave the ratio of the path's directions, and nothing else of it
OF_HEALTHY = "band level, healthy bearing"  # no increment: its bias stands apart
PATH, NUMERICS = "path to the sensor", "numerics: step, slices and starts"
# Kinds whose errors are per cent of the rig's value, and of those ratios that are compared in logarithms.
RELATIVE, RATIOS = ("line frequency", "modulation depth", "kurtosis"), ("modulation depth", "kurtosis")
BACKGROUND_SEED = 11


def measured_entry(state: Fault, nominal_rpm: float) -> RegisteredRecording:
    """The register's entry of a record of the rig; `DataError` where there is none."""
    entry = find_recording(state=state, nominal_rpm=nominal_rpm)
    if entry is None:
        raise DataError(f"{state} {nominal_rpm:g} rpm: not registered; srbval data fetch torino-excerpts.")
    return entry


def measured(state: Fault, nominal_rpm: float) -> Recording:
    """A registered record of the rig."""
    return load_entry(measured_entry(state, nominal_rpm))


def run_of(record: Recording, state: Fault, changes: Mapping[str, Any]) -> Run:
    """The rig scene at the record's speed."""
    assert record.speed is not None
    own = {
        "defect": {"kind": state}, "shaft_speed_rad_s": 2 * math.pi * record.speed.value_hz,
        "duration_s": SECONDS, "solver": {"step_s": STEP_S},
    }  # fmt: skip
    run = simulate(load_scene("rig", merge(own, changes)), step=Step.UNCHECKED)
    if not run.status.usable:
        raise NumericsError(f"amplitudes: the run with {changes} failed ({run.status}): {run.reason}")
    return run


def values(read: Mapping[str, QuantityValue]) -> dict[str, float]:
    """The plain numbers."""
    return {name: value.value for name, value in read.items()}


def drawn_paths(path: SensorPath) -> list[SensorPath]:
    """Paths whose gains are off by as much as is not known of them."""
    random = np.random.default_rng(SEED)
    return [path.drawn(random) for _ in range(PATH_DRAWS)]


def with_background(run: Recording, healthy: Recording) -> Recording:
    """The run with the spectrum of the healthy record, its phases random; both at one rate."""
    length = min(run.samples, healthy.samples)
    both = one_signal(run)[:length] + phase_randomised(one_signal(healthy)[:length], BACKGROUND_SEED)
    return replace(run, channels={SENSOR: both}, channel=SENSOR, axes=None)


def rows(
    rig: Mapping[str, QuantityValue], model: Mapping[str, QuantityValue], parts: Mapping[str, Mapping[str, float]], *,
    record: str, fault: Fault, used_for: str, scene: str = "rig",
) -> tuple[Comparison, ...]:  # fmt: skip
    """A comparison of every quantity that both sides have.

    `parts` of the uncertainty besides the rig's reading: by name, 95 % half widths of quantities in their own units.
    Errors of `RATIOS` are 100 ln(model / rig). The error of a level that the rig does not show is the least that this
    allows: of a model beyond the `least` that would be shown.
    """
    found = []
    for name in (name for name in rig if name in model):
        value, kind = rig[name], kind_of(name)
        relative = kind in RELATIVE
        unit, scale = ("%", 100 / value.value) if relative else ("dB", 1.0)
        widths = {RIG_READING: value.ci95 or 0.0} | {part: of[name] for part, of in parts.items() if name in of}
        shift = model[name].value - value.value
        if kind in RATIOS:
            shift = value.value * math.log(model[name].value / value.value)
        elif not value.present and value.least > -math.inf:
            shift = max(model[name].value - value.least, 0.0)
        found.append(
            Comparison(
                kind=kind, state=fault, quantity=name, unit="1" if relative else "dB", error_unit=unit, record=record,
                scene=scene, margin=CAGE_RATIO.margin if name == CAGE_RATIO.name else MARGIN[unit],
                used_for="fit" if record == DIRECTION and kind == "sideband level" else used_for,
                parts={part: scale * width for part, width in widths.items()}, rig=value, model=model[name],
                error=scale * shift,
            )
        )  # fmt: skip
    return tuple(found)


def kind_of(name: str) -> str:
    """The kind of a quantity, as ``report.json`` has it."""
    kinds = {"harmonic": "harmonic pattern", "sidebands": "sideband level", "depth": "modulation depth"}
    kinds |= {"kurtosis": "kurtosis", "cage": "line frequency", "scaling": "speed scaling"}
    kinds |= {"locked": "locked level", "total": "total level"}
    return kinds.get(name.split()[0], "band level")


def scaling(slow: Mapping[str, QuantityValue], fast: Mapping[str, QuantityValue]) -> dict[str, QuantityValue]:
    """By how much each level rises from a slower to a faster record of one state [dB]; the path to the sensor cancels.

    Both records must show it.
    """
    return {
        f"scaling {name}": QuantityValue(
            value=fast[name].value - low.value, ci95=math.hypot(fast[name].ci95 or 0.0, low.ci95 or 0.0),
            present=fast[name].present and low.present,
        )
        for name, low in slow.items()
    }  # fmt: skip


def half_widths(draws: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """95 % half width of each quantity over draws of what is not known: Student's t times the standard deviation."""
    from scipy.special import stdtrit

    factor = float(stdtrit(len(draws) - 1, 0.975))
    return {name: factor * float(np.std([draw[name] for draw in draws], ddof=1)) for name in draws[0]}


def crps(error: float, u: float) -> float:
    """Continuous ranked probability score of a normal prediction off by `error`, in its unit; of a point its size.

    Gneiting & Raftery 2007, J. Am. Stat. Assoc. 102, 359, eq. 21; quoted from memory, checked against the integral.
    """
    if not u:
        return abs(error)
    z = error / u
    density = math.exp(-z * z / 2) / math.sqrt(2 * math.pi)
    return u * (z * math.erf(z / math.sqrt(2)) + 2 * density - 1 / math.sqrt(math.pi))
