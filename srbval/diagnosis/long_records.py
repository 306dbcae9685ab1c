"""Analysis of long records in parts as short as the records on which the method was calibrated (1 to 13 s).

A comb, a line with its harmonics, stays within one frequency bin only while the shaft turns evenly. If the speed
changes by 1 % in half an hour, or the spacing of impacts scatters by 1 %, combs are lost in parts of 60 s, and are no
stronger in parts of 20 s than in parts of 10 s.

Fault probabilities follow from the mean likelihood of all parts, but lines are read in one part only. To choose it, the
parts are ranked by their strongest fault comb: rank 1 is the part with the strongest comb of all. Of n parts, the part
of rank n/2 is read first; if no fault line is detected in it, the part of rank n/4, then n/8 and so on to rank 1. If no
part has a fault line, the part of rank n/2 is used. A choice among more parts finds a false line more often:
false-alarm probabilities are corrected for n / rank trials, such as four for rank n/4.
"""

import itertools
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from srbval.bearing import DEFECTS, Bearing
from srbval.diagnosis.fault_posterior import FaultScores, fault_scores
from srbval.errors import DataError
from srbval.processes.machine import one_thread
from srbval.reading.analyse import Analysis, analyse, with_spread
from srbval.reading.lines import detected_fault_lines
from srbval.reading.pipeline import choose_tracking, process, whole_band_of
from srbval.reading.speed_search import SpeedSearch
from srbval.recordings import Recording, SpeedSource

PART_S, PART_TURNS = 10.0, 100  # least length of a part, and least number of turns in it
LEAST_PARTS = 3  # shorter records are read as a whole


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class LongAnalysis(Analysis):
    """Analysis of one part of a long record, which is divided into `parts` parts; this part begins at `first_s` [s].

    `as_clear` is the number of parts, this part included, whose strongest fault comb is at least as strong as this
    part's. `views` contains the comb scores of every part, each with the name of its channel.
    """

    parts: int
    as_clear: int
    first_s: float
    views: tuple[tuple[str | None, FaultScores], ...]

    @property
    def read_in(self) -> str:
        """Number and length of the parts, and the part whose lines are used, in words."""
        part_s = self.recording.seconds / self.parts
        return (
            f"read in {self.parts} parts of {part_s:.3g} s: probabilities from the combs of all parts; lines, band and "
            f"figures from the part that begins at {self.first_s:.5g} s, one of the {self.as_clear} clearest"
        )

    def to_dict(self) -> dict[str, Any]:
        """Values for JSON: analysis of one part of a long record; ``long_record`` describes the choice of this part."""
        keys = ("parts", "as_clear", "first_s", "read_in")
        return super().to_dict() | {"long_record": {key: getattr(self, key) for key in keys}}


@one_thread()
def analyse_by_parts(recording: Recording, bearing: Bearing, *, all_channels: bool = False, **options: Any) -> Analysis:
    """Analyse a record by `analyse` with `options`; a long record is divided, its unreadable parts are left out."""
    shaft_hz = recording.known_speed.value_hz
    count = math.floor(recording.seconds / max(PART_S, PART_TURNS / shaft_hz))
    if count < LEAST_PARTS:
        return analyse(recording, bearing=bearing, **options)
    bounds = np.linspace(0, recording.samples, count + 1).astype(int).tolist()
    names = list(recording.channels) if all_channels and recording.channel is not None else [recording.channel]
    names.sort(key=lambda name: name != recording.channel)
    scored, failed = dict[tuple[int, int], list[tuple[str | None, FaultScores]]](), list[DataError]()
    for place in itertools.pairwise(bounds):
        part = recording.part(*place)
        try:
            scored[place] = [(name, _scores(replace(part, channel=name), bearing)) for name in names]
        except DataError as error:
            failed.append(error)
    if not scored:
        raise failed[0]
    clear = sorted(scored, key=lambda place: -max(scored[place][0][1].first[fault].log_ratio for fault in DEFECTS))
    found = dict[int, Analysis]()
    for halved in range(1, max(2, len(clear).bit_length())):
        rank = max(1, len(clear) >> halved)
        trials = math.ceil(len(clear) / rank)
        found[rank] = analyse(recording.part(*clear[rank - 1]), bearing=bearing, trials=trials, **options)
        if detected_fault_lines(found[rank].lines):
            break
    else:
        rank = max(found)
    analysis = found[rank]
    views = [view for every in scored.values() for view in every]
    if analysis.speed.source is SpeedSource.ESTIMATED:
        views.append((recording.channel, fault_scores(analysis)))
    left_out = (f"left out: {len(failed)} of {count} parts, the first: {failed[0]}",) if failed else ()
    return LongAnalysis(
        **vars(analysis) | {"recording": replace(recording, cautions=(*analysis.recording.cautions, *left_out))},
        parts=count,
        as_clear=rank,
        first_s=clear[rank - 1][0] / recording.fs_hz,
        views=tuple(views),
    )


def _scores(part: Recording, bearing: Bearing) -> FaultScores:
    """Score the combs (lines with harmonics) of one time interval (`part`) of a record at its stated speed."""
    speed, tracking = part.known_speed, choose_tracking(part, bearing, part.known_speed)
    processed = process(part, band_hz=whole_band_of(part.fs_hz).band_hz, tracking=tracking)
    return fault_scores(SpeedSearch(processed=processed, bearing=bearing, lines=(), speed=with_spread(speed, tracking)))
