"""Questions that are asked of a scene, how a run answers them, and the error of an answer.

Every answer is read from a run through the pipeline of every recording; errors are in per cent. Amplitudes are read
like those of the rig's records, at the ring and without a background. If two levels are 3 dB apart, the greater one
exceeds the smaller one by 41 %, which is the error.
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

AnswerValues = tuple[float | None, ...]  # None: the quantity does not stand out


class Question(enum.StrEnum):
    """Question that is asked of a scene."""

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
    """A question in words: the quantity that its error refers to; see ``questions.toml``.

    `error`: how two answers make one, see `error_pct`. `tolerance`: usual tolerance, in the question's unit. `states`:
    defects that it is asked of, all if empty. `read`: names of the amplitudes that answer it.
    """

    title: str
    error_of: str
    error: str
    tolerance: float
    states: Sequence[str] = ()
    read: Sequence[str] = ()

    @property
    def unit(self) -> str:
        """Unit in which its errors are stated."""
        return "dB" if self.error == "apart" else "%"

    @property
    def tolerance_pct(self) -> float:
        """The usual tolerance [%]."""
        return pct_of(self.tolerance) if self.unit == "dB" else self.tolerance

    @property
    def vacuous_pct(self) -> float:
        """Error as large as the quantity itself, or a factor of ten in a level: a bound above it tells nothing [%]."""
        return pct_of(20.0) if self.unit == "dB" else 100.0

    def shown(self, error_pct: float) -> float:
        """An error in the question's unit."""
        return error_pct if self.unit == "%" else 20 * math.log10(1 + error_pct / 100)

    def text(self, error_pct: float) -> str:
        """An error in words."""
        return f"{self.shown(error_pct):.3g} {self.unit}"


def pct_of(db: float) -> float:
    """Excess of the greater of two amplitudes over the smaller one [%], if they are `db` apart."""
    return 100 * (10 ** (db / 20) - 1)


MEANING: Mapping[Question, Meaning] = {
    Question(name): Meaning(**about) for name, about in read_toml(Path(__file__).parent / "questions.toml").items()
}


def asked_of(kind: Fault) -> tuple[Question, ...]:
    """The questions that apply to a defect: a healthy bearing has no line with harmonics and sidebands."""
    return tuple(q for q in Question if kind.scene_word in (MEANING[q].states or (kind.scene_word,)))


def answers(run: Run, bearing: Bearing, healthy: Recording | None = None) -> dict[Question, AnswerValues | None]:
    """Answers of a successful run to every question; None without an answer and if the run is too short.

    A level of the increment needs `healthy`, the same model's record without the defect. The frequency of a line
    follows from the mean cage speed (BPFO of a healthy bearing, none of a defect on a roller): a reading from a record
    of seconds is uncertain by some tenths of a per cent, which would hide the errors of models.
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
    if run.seconds >= MIN_SECONDS_FOR_FLOOR:  # the envelope is of the normalised signal
        envelope, spread_m_s2 = analysis.processed.envelope, float(along_sensor(run.acceleration_m_s2).std())
        floor = noise_floor(envelope, analysis.processed.fs_hz) * float(envelope.mean())
        found[Question.NOISE_FLOOR] = (floor * spread_m_s2,)
    order = kind.passing_order(run.rolling_elements, ratio)
    return found | _amplitudes(record, kind, order, bearing, healthy)


def _amplitudes(
    record: Recording, kind: Fault, order: float | None, bearing: Bearing, healthy: Recording | None
) -> dict[Question, AnswerValues | None]:
    """Amplitudes of a record that reaches far enough; the line's `order` is the cage's."""
    if record.fs_hz < 2 * amplitudes.WHOLE_HZ[1]:
        return {}
    own = amplitudes.kurtoses(record) if order is None else amplitudes.pattern(record, bearing, kind, order)
    own |= amplitudes.levels(record, None)
    over = {} if healthy is None else amplitudes.levels(record, healthy)
    found: dict[Question, AnswerValues | None] = {}
    for question in (question for question, meaning in MEANING.items() if meaning.read):
        values = over if question is Question.THIRD_OCTAVES else own
        read = (values.get(name) for name in MEANING[question].read)
        answer = tuple(one.value if one and one.present else None for one in read)
        found[question] = None if set(answer) == {None} else answer
    return found


def error_pct(question: Question, own: AnswerValues | None, right: AnswerValues | None) -> float | None:
    """Error of an answer [%]; None if either is missing or a value of the reference's is not shown."""
    if own is None or right is None:
        return None
    # Of each quantity that stands out in the reference; one that does not stand out in `own` is infinitely far away.
    shown = [(math.inf if a is None else abs(a - b), abs(b)) for a, b in zip(own, right, strict=True) if b is not None]
    if MEANING[question].error == "apart":
        error = pct_of(max(off for off, _ in shown))
    else:
        error = 100 * max(off / of if of else math.inf for off, of in shown)
    return error if math.isfinite(error) else None
