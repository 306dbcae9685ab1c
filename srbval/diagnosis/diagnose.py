"""The fault that a record shows by itself: posterior probabilities learnt from records of known state of other rigs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from srbval.bearing import DEFECTS, Fault
from srbval.diagnosis.fault_posterior import UNDECIDED, decide, evidence, most_probable
from srbval.diagnosis.fault_scores import FaultScores, fault_scores
from srbval.processes.machine import one_thread
from srbval.reading.analyse import Analysis
from srbval.reading.lines import OTHER_LINE
from srbval.reading.pipeline import process
from srbval.recordings import SpeedSource


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """Class called (`state`) and `probabilities` of all classes.

    "undecided" means that no class is probable enough, or that the line of the part contradicts the speed used
    (`contradicts_speed`). `log_likelihood` is that of each class over healthy, for other priors. `rigs` is the number
    of rigs learnt from. `channel` shows the class best, and `scores` belong to it.
    """

    state: str
    probabilities: Mapping[str, float]
    log_likelihood: Mapping[str, float]
    scores: FaultScores
    rigs: int
    channel: str | None

    @property
    def best_class(self) -> str:
        """The most probable class."""
        return most_probable(self.probabilities)

    @property
    def sentence(self) -> str:
        """The diagnosis in words."""
        shares = ", ".join(f"{label_of(name)} {100 * share:.0f} %" for name, share in self.probabilities.items())
        if decide(self.probabilities) == UNDECIDED:
            answer = "none is probable enough to be named"
        elif self.state == UNDECIDED:
            answer = "none is named, for its line is not there at the speed stated"
        else:
            answer = "no fault is named" if self.state == Fault.HEALTHY else f"named: {label_of(self.state)}"
        order, excess = self.scores.unexplained_order, self.scores.unexplained
        comb = "" if order is None else f"Strongest unexplained comb: order {order:.3f}, evidence {excess:.1f}."
        best = "" if self.channel is None else f"Channel {self.channel} shows it best."
        cage = (
            f"The cage's comb stands out (evidence {self.scores.cage or 0.0:.1f}), as of one rolling element or one "
            "pocket that strikes once a turn of the cage; it names no fault."
        )
        said = (
            f"By the record alone, beside records of known state of {self.rigs} rigs and with a healthy bearing as "
            f"probable beforehand as all else together: {shares}; {answer}."
        )
        return " ".join(filter(None, (said, best, comb, cage if self.scores.cage_shows else "")))


def label_of(name: str) -> str:
    """Name of a class in words."""
    return Fault(name).label if name in tuple(Fault) else "something else"


def fault_of(name: str) -> Fault | None:
    """The fault of a class; None if the class is no fault of a part."""
    return next((fault for fault in DEFECTS if fault.value == name), None)


def contradicts_speed(analysis: Analysis, part: Fault | None) -> bool:
    """True if the comb of a `part` would be its line only at a speed other than the one used."""
    if part is None or (line := analysis.line_of(part)).detected:
        return False
    return analysis.outside_speed is not None or line.explained_by == OTHER_LINE


@one_thread()
def diagnose(analysis: Analysis, *, all_channels: bool = False) -> Diagnosis:
    """Name the fault of an analysed record.

    With `all_channels` other channels of the record are views too. If the speed was estimated from the record, the
    stated speed within its tolerance is a further view: the estimate may belong to another shaft.
    """
    by, scored = evidence(), views_of(analysis, all_channels=all_channels)
    features = [np.array(one.features) for _, one in scored]
    together = by.log_likelihood(*features)
    shares = by.probabilities(together)
    found = most_probable(shares)
    best = int(np.argmax([by.log_likelihood(one)[found] for one in features]))
    return Diagnosis(
        state=UNDECIDED if contradicts_speed(analysis, fault_of(found)) else decide(shares),
        probabilities=shares,
        log_likelihood=together,
        scores=scored[best][1],
        rigs=by.rigs,
        channel=scored[best][0] if len(dict(scored)) > 1 and found != Fault.HEALTHY else None,
    )


def views_of(analysis: Analysis, *, all_channels: bool) -> list[tuple[str | None, FaultScores]]:
    """Channel and scores of each view of a record, see `diagnose`; channels are of the same length, not constant."""
    recording, done = analysis.recording, analysis.processed
    views, own = [(recording.channel, analysis)], recording.channels.get(recording.channel or "")
    for name, x in recording.channels.items() if all_channels else ():
        if name != recording.channel and own is not None and x.size == own.size and x.min() < x.max():
            other = process(replace(recording, channel=name), band_hz=done.band_hz, tracking=done.tracking)
            views.append((name, replace(analysis, processed=other)))
    if analysis.speed.source is SpeedSource.ESTIMATED and recording.speed is not None:
        views += [(name, replace(view, speed=recording.speed)) for name, view in views]
    return [(name, fault_scores(view)) for name, view in views]
