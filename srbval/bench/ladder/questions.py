"""Questions that are asked of a scene, how a run answers them, and the error of an answer.

Every answer is read from a run through the pipeline of every recording; errors are in per cent.
"""

import enum
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft

from srbval.arrays import FloatArray
from srbval.bearing import RACE_DEFECTS, Bearing, Fault
from srbval.bench.measures import measure, smooth_mean
from srbval.errors import DataError
from srbval.models.band_levels import along_sensor
from srbval.models.run import Run
from srbval.recordings import recording_from_run
from srbval.validation.analyse import Analysis, analyse

Answer = tuple[float, ...]

SIDEBANDS = (-2, -1, 1, 2)  # multiples of the shaft speed about the line
HARMONICS = 5
PADDING = 4  # times the record's length
REACH = 1.0  # resolutions either side of a line in which its top is looked for
FAINT = 0.05  # errors of sidebands refer to the reference's strongest, but at least to this share of the line


class Question(enum.StrEnum):
    """What is asked of a scene."""

    LINES = "lines"
    HARMONICS = "harmonics"
    SIDEBANDS = "sidebands"
    NOISE_FLOOR = "noise-floor"
    SLIP = "slip"
    AMPLITUDE = "amplitude"


@dataclass(frozen=True, kw_only=True)
class Meaning:
    """A question in words, what its error is relative to, and how two answers make an error [%]."""

    title: str
    error_of: str
    error: Callable[[Answer, Answer], float]


def _relative(own: Answer, right: Answer) -> float:
    return 100 * max(abs(a - b) / abs(b) if b else math.inf for a, b in zip(own, right, strict=True))


def _of_first(own: Answer, right: Answer) -> float:
    return 100 * max(abs(a - b) for a, b in zip(own, right, strict=True))


def _of_strongest(own: Answer, right: Answer) -> float:
    return 100 * max(abs(a - b) for a, b in zip(own, right, strict=True)) / max(FAINT, *right)


MEANING: Mapping[Question, Meaning] = {
    Question.LINES: Meaning(
        title="line frequencies", error_of="the defect's line as the mean cage speed makes it", error=_relative
    ),
    Question.HARMONICS: Meaning(
        title="harmonic pattern", error_of="the first harmonic's height, worst of five", error=_of_first
    ),
    Question.SIDEBANDS: Meaning(
        title="sidebands and load-zone modulation",
        error_of="the strongest sideband at one or two shaft speeds from the line",
        error=_of_strongest,
    ),
    Question.NOISE_FLOOR: Meaning(
        title="noise floor", error_of="the envelope's floor at 60 to 90 Hz, in m/s2", error=_relative
    ),
    Question.SLIP: Meaning(title="slip", error_of="the cage speed's excess over kinematics", error=_relative),
    Question.AMPLITUDE: Meaning(title="amplitude", error_of="the RMS acceleration of 500 to 1500 Hz", error=_relative),
}


def asked_of(kind: Fault) -> tuple[Question, ...]:
    """The questions that apply to a defect: a healthy bearing has no line with harmonics and sidebands."""
    empty = (Question.HARMONICS, Question.SIDEBANDS) if kind is Fault.HEALTHY else ()
    return tuple(q for q in Question if q not in empty)


def answers(run: Run, bearing: Bearing) -> dict[Question, Answer | None]:
    """The answers of a successful run to every question; None where it has none or is too short.

    A line's frequency is that of the cage passing the race, which a defect there has on average: read from a record of
    seconds it would be some tenths of a per cent uncertain, and errors of models would be hidden by that.
    """
    ratio = smooth_mean(run.cage_rad_s) / run.scene.mean_shaft_rad_s
    found: dict[Question, Answer | None] = dict.fromkeys(Question)
    found[Question.SLIP] = (ratio / bearing.orders.ftf - 1,)
    found[Question.LINES] = _line_of_cage(run, ratio)
    try:
        measures = measure(run)
        analysis = analyse(recording_from_run(run), bearing=bearing)
    except DataError:
        return found
    found[Question.AMPLITUDE] = (measures.band_rms_m_s2,)
    spread_m_s2 = float(along_sensor(run.acceleration_m_s2).std())
    if measures.noise_floor is not None:  # of the envelope's mean, that of the normalised signal
        found[Question.NOISE_FLOOR] = (measures.noise_floor * float(analysis.processed.envelope.mean()) * spread_m_s2,)
    return found | _of_line(run, analysis)


def _line_of_cage(run: Run, ratio: float) -> Answer | None:
    """BPFO or BPFI, by the defect; BPFO of a healthy bearing; None for a defect on a roller."""
    kind = run.scene.defect.kind
    passed = Fault.OUTER if kind is Fault.HEALTHY else kind
    order = passed.passing_order(run.rolling_elements, ratio)
    return None if order is None else (order * run.scene.shaft_hz,)


def _of_line(run: Run, analysis: Analysis) -> dict[Question, Answer | None]:
    kind = run.scene.defect.kind
    line = analysis.line_of(kind) if kind in RACE_DEFECTS else None
    if line is None or not line.detected or line.found_hz is None:
        return {}
    spacing, first = run.scene.shaft_hz, line.found_hz
    harmonics = [k * first for k in range(1, HARMONICS + 1)]
    heights = line_heights(analysis.processed.envelope, analysis.processed.fs_hz, harmonics)
    sides = line_heights(
        analysis.processed.envelope, analysis.processed.fs_hz, [first + k * spacing for k in SIDEBANDS]
    )
    return {
        Question.HARMONICS: tuple(height / heights[0] for height in heights),
        Question.SIDEBANDS: tuple(height / heights[0] for height in sides),
    }


def line_heights(envelope: FloatArray, fs_hz: float, lines_hz: Sequence[float]) -> list[float]:
    """Height of an envelope's spectrum at each line, its top within `REACH` resolutions.

    Hann window and zero padding: without them a line between two bins reads up to a third low. A sine of amplitude a
    reads a.
    """
    length = scipy.fft.next_fast_len(PADDING * envelope.size, real=True)
    window = np.sin(np.pi * (np.arange(envelope.size) + 0.5) / envelope.size) ** 2
    spectrum = np.abs(scipy.fft.rfft((envelope - envelope.mean()) * window, n=length)) * (2 / window.sum())
    bin_hz, reach_hz = fs_hz / length, REACH * fs_hz / envelope.size
    heights = []
    for line_hz in lines_hz:
        low, high = math.ceil((line_hz - reach_hz) / bin_hz), math.floor((line_hz + reach_hz) / bin_hz)
        heights.append(float(spectrum[max(low, 0) : high + 1].max()))
    return heights


def error_pct(question: Question, own: Answer | None, right: Answer | None) -> float | None:
    """Error of an answer; None where either is missing."""
    if own is None or right is None:
        return None
    error = MEANING[question].error(own, right)
    return error if math.isfinite(error) else None
