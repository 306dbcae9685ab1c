"""Amplitudes of the rig's records compared with the scene `rig` behind its path to the sensor, and scores of that.

Depth and kurtosis hang on the background: the healthy record's spectrum with random phases is added to the model's for
these, and for nothing else.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from srbval.bearing import Fault
from srbval.comparison.compared_quantities import CAGE_RATIO
from srbval.comparison.comparison import RIG_READING, Comparison, QuantityValue
from srbval.path.amplitudes import MARGIN
from srbval.reading.pipeline import one_signal
from srbval.recordings import Recording
from srbval.recordings.datasets.srbval_files import SENSOR
from srbval.signal import phase_randomised

PATH, NUMERICS, SURFACES = "path to the sensor", "numerics: step, slices and starts", "waves on races and rollers"
RELATIVE = ("line frequency", "modulation depth", "kurtosis")  # kinds whose errors are per cent of the rig's value
BACKGROUND_SEED = 11


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
    """
    found = []
    for name in (name for name in rig if name in model):
        value, kind = rig[name], kind_of(name)
        relative = kind in RELATIVE
        unit, scale = ("%", 100 / value.value) if relative else ("dB", 1.0)
        widths = {RIG_READING: value.ci95 or 0.0} | {part: of[name] for part, of in parts.items() if name in of}
        found.append(
            Comparison(
                kind=kind, state=fault, quantity=name, unit="1" if relative else "dB", error_unit=unit, record=record,
                scene=scene, margin=CAGE_RATIO.margin if name == CAGE_RATIO.name else MARGIN[unit], used_for=used_for,
                parts={part: scale * width for part, width in widths.items()}, rig=value, model=model[name],
                error=scale * (model[name].value - value.value),
            )
        )  # fmt: skip
    return tuple(found)


def kind_of(name: str) -> str:
    """The kind of a quantity, as ``report.json`` has it."""
    kinds = {"harmonic": "harmonic pattern", "sidebands": "sideband level", "depth": "modulation depth"}
    kinds |= {"kurtosis": "kurtosis", "cage": "line frequency", "scaling": "speed scaling"}
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
