"""Questions that are asked of a scene, how a run answers them, and the error of an answer.

Every answer is read from a run through the pipeline of every recording; errors are in per cent. Amplitudes are read and
named as where the rig's are compared, at the ring and without a background; of two that are 3 dB apart the greater
exceeds the smaller by 41 %, and that is the error.
"""

import enum
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from srbval.bearing import RACE_DEFECTS, Bearing, Fault
from srbval.comparison.comparison import QuantityValue
from srbval.errors import DataError
from srbval.models.run import Run
from srbval.models.sensor import along_sensor
from srbval.path import amplitudes
from srbval.plan.measures import harmonic_pattern, line_heights, measure, smooth_mean
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings import Recording, recording_from_run
from srbval.storage.tables import read_toml

Answer = tuple[float | None, ...]  # None: it does not stand out

SIDEBANDS = (-2, -1, 1, 2)  # multiples of the shaft speed about the line
FAINT = 0.05  # errors of sidebands refer to the reference's strongest, but at least to this share of the line


class Question(enum.StrEnum):
    """What is asked of a scene."""

    LINES = "lines"
    HARMONICS = "harmonics"
    SIDEBANDS = "sidebands"
    NOISE_FLOOR = "noise-floor"
    SLIP = "slip"
    POWER = "power"
    AMPLITUDE = "amplitude"
    LEVELS = "levels"
    THIRD_OCTAVES = "third-octaves"
    HARMONIC_LEVELS = "harmonic-levels"
    SIDEBAND_LEVELS = "sideband-levels"
    DEPTH = "depth"
    KURTOSIS = "kurtosis"


@dataclass(frozen=True, kw_only=True)
class Meaning:
    """A question in words, what its error is relative to, how two answers make an error [%]; see ``questions.toml``."""

    title: str
    error_of: str
    error: Callable[[Answer, Answer], float]
    states: Sequence[str] = ()
    read: Sequence[str] = ()

    @property
    def unit(self) -> str:
        """That its errors are stated in."""
        return "dB" if self.error is _apart else "%"

    @property
    def margin_pct(self) -> float | None:
        """Within which an amplitude counts as near, as where the rig's are compared; None of all else."""
        margin = amplitudes.MARGIN[self.unit]
        return (pct_of(margin) if self.unit == "dB" else margin) if self.read else None

    def shown(self, error_pct: float) -> float:
        """An error in the unit that it is stated in."""
        return error_pct if self.unit == "%" else 20 * math.log10(1 + error_pct / 100)

    def text(self, error_pct: float) -> str:
        """The same in words."""
        return f"{self.shown(error_pct):.3g} {self.unit}"


def pct_of(db: float) -> float:
    """By how much the greater of two amplitudes `db` apart exceeds the smaller [%]."""
    return 100 * (10 ** (db / 20) - 1)


def _pairs(own: Answer, right: Answer) -> list[tuple[float, float]]:
    """What stands out on the right side, and the other's; infinite where it does not there."""
    return [(math.inf if a is None else a, b) for a, b in zip(own, right, strict=True) if b is not None]


def _relative(own: Answer, right: Answer) -> float:
    return 100 * max(abs(a - b) / abs(b) if b else math.inf for a, b in _pairs(own, right))


def _of_first(own: Answer, right: Answer) -> float:
    return 100 * max(abs(a - b) for a, b in _pairs(own, right))


def _of_strongest(own: Answer, right: Answer) -> float:
    return _of_first(own, right) / max(FAINT, *(b for _, b in _pairs(own, right)))


def _apart(own: Answer, right: Answer) -> float:
    return pct_of(max(abs(a - b) for a, b in _pairs(own, right)))


ERRORS = {"relative": _relative, "of first": _of_first, "of strongest": _of_strongest, "apart": _apart}
MEANING: Mapping[Question, Meaning] = {
    Question(name): Meaning(**about | {"error": ERRORS[about["error"]]})
    for name, about in read_toml(Path(__file__).parent / "questions.toml").items()
}


def asked_of(kind: Fault) -> tuple[Question, ...]:
    """The questions that apply to a defect: a healthy bearing has no line with harmonics and sidebands."""
    return tuple(q for q in Question if kind.scene_word in (MEANING[q].states or (kind.scene_word,)))


def answers(run: Run, bearing: Bearing, healthy: Recording | None = None) -> dict[Question, Answer | None]:
    """The answers of a successful run to every question; None where it has none or is too short.

    An increment is over `healthy`, the same model's without the defect, and has no answer where that is not given.

    A line's frequency is that of the cage passing the race (BPFO of a healthy bearing, none of a defect on a roller),
    which a defect there has on average: read from a record of seconds it would be some tenths of a per cent uncertain,
    and errors of models would be hidden by that.
    """
    ratio = smooth_mean(run.cage_rad_s) / run.scene.mean_shaft_rad_s
    found: dict[Question, Answer | None] = dict.fromkeys(Question)
    found[Question.SLIP] = (ratio / bearing.orders.ftf - 1,)
    found[Question.POWER] = (run.drive_power_w,) if math.isfinite(run.drive_power_w) else None
    kind = run.scene.defect.kind
    passed = (Fault.OUTER if kind is Fault.HEALTHY else kind).passing_order(run.rolling_elements, ratio)
    found[Question.LINES] = None if passed is None else (passed * run.scene.shaft_hz,)
    try:
        measures = measure(run)
        analysis = analyse(recording_from_run(run), bearing=bearing)
    except DataError:
        return found
    found[Question.AMPLITUDE] = (measures.band_rms_m_s2,)
    spread_m_s2 = float(along_sensor(run.acceleration_m_s2).std())
    if measures.noise_floor is not None:  # of the envelope's mean, that of the normalised signal
        found[Question.NOISE_FLOOR] = (measures.noise_floor * float(analysis.processed.envelope.mean()) * spread_m_s2,)
    return found | _of_line(run, analysis) | _amplitudes(run, ratio, bearing, healthy)


def _amplitudes(run: Run, ratio: float, bearing: Bearing, healthy: Recording | None) -> dict[Question, Answer | None]:
    """Read as the rig's records are, the line's order from the cage."""
    record, kind = recording_from_run(run), run.scene.defect.kind
    if record.fs_hz < 2 * amplitudes.WHOLE_HZ[1]:
        return {}
    order = kind.passing_order(run.rolling_elements, ratio)
    own = amplitudes.kurtoses(record) if order is None else amplitudes.pattern(record, bearing, kind, order)
    own |= amplitudes.levels(record, None)
    found = {question: _shown(own, meaning.read) for question, meaning in MEANING.items() if meaning.read}
    over = {} if healthy is None else amplitudes.levels(record, healthy)
    return found | {Question.THIRD_OCTAVES: _shown(over, MEANING[Question.THIRD_OCTAVES].read)}


def _shown(own: Mapping[str, QuantityValue], names: Sequence[str]) -> Answer | None:
    read = tuple(own[name].value if name in own and own[name].present else None for name in names)
    return None if set(read) == {None} else read


def _of_line(run: Run, analysis: Analysis) -> dict[Question, Answer | None]:
    kind = run.scene.defect.kind
    line = analysis.line_of(kind) if kind in RACE_DEFECTS else None
    if line is None or not line.detected or line.found_hz is None:
        return {}
    spacing, first = run.scene.shaft_hz, line.found_hz
    envelope, fs_hz = analysis.processed.envelope, analysis.processed.fs_hz
    height, *sides = line_heights(envelope, fs_hz, [first, *(first + k * spacing for k in SIDEBANDS)])
    return {
        Question.HARMONICS: harmonic_pattern(envelope, fs_hz, first),
        Question.SIDEBANDS: tuple(side / height for side in sides),
    }


def error_pct(question: Question, own: Answer | None, right: Answer | None) -> float | None:
    """Error of an answer; None where either is missing."""
    if own is None or right is None:
        return None
    error = MEANING[question].error(own, right)
    return error if math.isfinite(error) else None
