"""Questions about a scene, their answers from a run, and the error of an answer [%].

Amplitudes are read from the simulated vibration in the same way as from the paper's recordings of its test rig, but
without the background noise of the rig. Errors of levels are converted to per cent of the amplitude: 3 dB are 41 %.
"""

import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from srbval.bearing import Bearing, Fault
from srbval.errors import DataError
from srbval.models.run import Run
from srbval.models.sensor import along_sensor
from srbval.path import amplitudes
from srbval.plan.measures import BAND_NAME, MIN_SECONDS_FOR_FLOOR, noise_floor, smooth_mean
from srbval.reading.analyse import analyse
from srbval.recordings import Recording, recording_from_run
from srbval.storage.tables import read_toml

AnswerValues = tuple[float | None, ...]  # None: the quantity does not exceed the noise


class Question(enum.StrEnum):
    """Question that a simulation of a scene can answer, such as its line frequencies."""

    LINES = "lines"
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
    """Description of a question; see ``questions.toml``.

    `unit` is dB for levels, otherwise %; errors of answers have this unit, and so has `tolerance`, the error usually
    accepted. `states` are the defects to which the question applies, all if empty. `read` contains the names, in
    `srbval.path.amplitudes`, of the amplitudes that answer the question.
    """

    title: str
    error_of: str
    unit: str
    tolerance: float
    states: Sequence[str] = ()
    read: Sequence[str] = ()

    @property
    def tolerance_pct(self) -> float:
        """Error of an answer that is usually accepted [%]."""
        return pct_of(self.tolerance) if self.unit == "dB" else self.tolerance

    @property
    def vacuous_pct(self) -> float:
        """Error bound [%] that is too large to be of use: as large as the quantity, or a factor of ten for levels."""
        return pct_of(20.0) if self.unit == "dB" else 100.0

    def shown(self, error_pct: float) -> float:
        """Convert an error from per cent to the question's unit."""
        return error_pct if self.unit == "%" else 20 * math.log10(1 + error_pct / 100)

    def text(self, error_pct: float) -> str:
        """Convert an error from per cent to text in the question's unit."""
        return f"{self.shown(error_pct):.3g} {self.unit}"


def pct_of(db: float) -> float:
    """Convert a difference of two levels [dB] to the excess of the greater amplitude over the smaller one [%]."""
    return 100 * (10 ** (db / 20) - 1)


MEANING: Mapping[Question, Meaning] = {
    Question(name): Meaning(**about) for name, about in read_toml(Path(__file__).parent / "questions.toml").items()
}


def asked_of(kind: Fault) -> tuple[Question, ...]:
    """Questions that apply to a defect; a healthy bearing has no fault line with harmonics and sidebands."""
    return tuple(q for q in Question if kind.scene_word in (MEANING[q].states or (kind.scene_word,)))


def answer_questions(
    run: Run, bearing: Bearing, healthy: Recording | None = None
) -> dict[Question, AnswerValues | None]:
    """Compute the answers of a successful run to all questions; None if the run is too short or has no answer.

    The level increase by the defect needs `healthy`, a record of the same model without the defect. The frequency of
    the fault line (BPFO for a healthy bearing, None for a roller defect) is computed from the mean cage speed, because
    a line read from a short record is uncertain by some tenths of a per cent, more than the errors of the models.
    """
    ratio = smooth_mean(run.cage_rad_s) / run.scene.mean_shaft_rad_s
    found: dict[Question, AnswerValues | None] = dict.fromkeys(Question)
    found[Question.SLIP] = (ratio / bearing.orders.ftf - 1,)
    found[Question.POWER] = (run.drive_power_w,) if math.isfinite(run.drive_power_w) else None
    kind = run.scene.defect.kind
    passed = (Fault.OUTER if kind is Fault.HEALTHY else kind).passing_order(run.rolling_elements, ratio)
    found[Question.LINES] = None if passed is None else (passed * run.scene.shaft_hz,)
    try:
        record = recording_from_run(run)
        analysis = analyse(record, bearing=bearing)
    except DataError:
        return found
    found[Question.AMPLITUDE] = (run.band_rms_m_s2[BAND_NAME],)
    if run.seconds >= MIN_SECONDS_FOR_FLOOR:  # the envelope belongs to the normalised signal
        envelope, spread_m_s2 = analysis.processed.envelope, float(along_sensor(run.acceleration_m_s2).std())
        floor = noise_floor(envelope, analysis.processed.fs_hz) * float(envelope.mean())
        found[Question.NOISE_FLOOR] = (floor * spread_m_s2,)
    if record.fs_hz < 2 * amplitudes.WHOLE_HZ[1]:  # sampled too slowly for amplitudes
        return found
    order = kind.passing_order(run.rolling_elements, ratio)
    own = amplitudes.kurtoses(record) if order is None else amplitudes.pattern(record, bearing, kind, order)
    own |= amplitudes.levels(record, None)
    over = {} if healthy is None else amplitudes.levels(record, healthy)
    for question in (question for question, meaning in MEANING.items() if meaning.read):
        values = over if question is Question.THIRD_OCTAVES else own
        read = (values.get(name) for name in MEANING[question].read)
        answer = tuple(one.value if one and one.present else None for one in read)
        found[question] = None if set(answer) == {None} else answer
    return found


def error_pct(question: Question, own: AnswerValues | None, right: AnswerValues | None) -> float | None:
    """Error [%] of answer `own` against reference `right`; None if one is missing or `own` lacks a value of `right`."""
    if own is None or right is None:
        return None
    # Quantities that are present in the reference; the error is infinite if the quantity is missing in `own`.
    shown = [(math.inf if a is None else abs(a - b), abs(b)) for a, b in zip(own, right, strict=True) if b is not None]
    if MEANING[question].unit == "dB":
        error = pct_of(max(off for off, _ in shown))
    else:
        error = 100 * max(off / of if of else math.inf for off, of in shown)
    return error if math.isfinite(error) else None
