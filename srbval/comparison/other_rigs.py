"""Recordings of other rigs: does the same pipeline find the lines that should be there?"""

import dataclasses
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.bearing import DEFECTS, Bearing, Fault, load_bearing
from srbval.comparison.speed_and_slip import cage_factor
from srbval.diagnosis.baseline import BaselineComparison, compare_with_baseline
from srbval.diagnosis.fault_verdict import is_fault_like
from srbval.errors import SrbvalError
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.lines import RACE_LINES, Line, line_entry
from srbval.recordings import Origin, Recording, ShaftSpeed, SpeedSource
from srbval.recordings.datasets.description import dataset
from srbval.recordings.registry import (
    RIG_DATASETS,
    FileStatus,
    RegisteredRecording,
    healthy_baseline,
    load_entry,
    without_copies,
)

Baselines = dict[tuple[str, str, tuple[float, float] | None], Analysis]  # by file, bearing and band


@dataclass(frozen=True, kw_only=True)
class OtherRecord:
    """One record of another rig: the line of its declared state (the deepest race line of a healthy one).

    `shown` says whether that line was detected and no other race line is deeper; for a healthy record
    whether any race line is like a fault's. `grade` is the record's in the published study the set's
    description names, by the best of its methods, `plain_grade` by a plain envelope alone; None without one.
    `cage_pct` is what the line's deviation at the record's own speed means for the cage, where a race line shows and
    the speed is more than a set point: a slipping cage is negative. `caution` is what the set says of this record in
    particular, `cautions` what its file and samples show, `refused` why a record could not be analysed.
    """

    dataset: str
    file: str
    state: Fault | None
    speed: ShaftSpeed | None = None
    line: Line | None = None
    shown: bool = False
    grade: str | None = None
    plain_grade: str | None = None
    radial_n: float | None = None
    cage_pct: float | None = None
    cage_ci95_pct: float | None = None
    call: BaselineComparison | None = None
    caution: str = ""
    cautions: tuple[str, ...] = ()
    refused: str = ""

    @property
    def diagnosable(self) -> bool | None:
        """Whether the study graded the record Y, that is diagnosable without reserve; None without a grade."""
        return None if self.grade is None else self.grade.startswith("Y")

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``."""
        speed = self.speed
        entry = vars(self) | line_entry(self.line) | {"diagnosable": self.diagnosable}
        del entry["speed"]
        return entry | {
            "shaft_hz": speed and speed.value_hz,
            "shaft_ci95_hz": speed and speed.ci95_hz,
            "speed_source": speed and speed.source,
        }


def read_other_rigs(registered: Sequence[RegisteredRecording], *, jobs: int | None = None) -> tuple[OtherRecord, ...]:
    """Every usable registered record of a known set that is not the rig's, in the order of set and file.

    `jobs` records are read at a time (default: one per core).
    """
    others, baselines = usable(registered), Baselines()
    ordered = sorted(others, key=lambda r: (r.dataset or "", r.file))
    with ThreadPoolExecutor(max_workers=jobs or os.cpu_count() or 1) as pool:
        return tuple(pool.map(lambda r: _record(r, tuple(others), baselines), ordered))


def usable(registered: Sequence[RegisteredRecording]) -> list[RegisteredRecording]:
    """Those of `registered` that are measured, whole, of a known set and not the rig's, each content once."""
    return without_copies(
        r
        for r in registered
        if r.dataset is not None
        and r.dataset not in RIG_DATASETS
        and r.status is FileStatus.OK
        and r.origin is Origin.MEASURED
    )


def _record(entry: RegisteredRecording, others: tuple[RegisteredRecording, ...], baselines: Baselines) -> OtherRecord:
    """Read one record; healthy ones that others are compared with are read once and stay in `baselines`."""
    about, path = dataset(entry.dataset or ""), Path(entry.file)
    grades = about.diagnosability
    record = OtherRecord(
        dataset=about.name,
        file="/".join(path.parts[-2:]),
        state=entry.state,
        grade=None if grades is None else grades.of(path.name),
        plain_grade=None if grades is None else grades.of(path.name, plain=True),
    )
    try:
        recording = load_entry(entry)
        if recording.bearing is None:
            return dataclasses.replace(record, refused="the set does not say the bearing's geometry or orders")
        analysis = analyse(recording, bearing=load_bearing(recording.bearing))
        healthy = healthy_analysis(recording, analysis.bearing, others, baselines)
    except SrbvalError as error:
        return dataclasses.replace(record, refused=str(error).removeprefix(f"{entry.file}: "))
    races = [analysis.line(name) for name in RACE_LINES]
    if record.state in DEFECTS:
        line = analysis.line_of(record.state)
        deeper = [race for race in races if race.detected and race.name != line.name]
        shown = line.detected and all((race.depth or 0.0) < (line.depth or 0.0) for race in deeper)
    else:
        line = max(races, key=lambda race: (race.detected, race.depth or 0.0))
        shown = any(is_fault_like(analysis, race) for race in races)
    shows_slip = line.detected and line.name in RACE_LINES and record.state in DEFECTS
    shows_slip &= analysis.speed.source is not SpeedSource.NOMINAL  # else it shows what the set point is worth
    to_cage = cage_factor(line.name, analysis.bearing) if shows_slip else None
    special = {one.note for one in about.records}
    return dataclasses.replace(
        record,
        radial_n=analysis.recording.radial_n,
        cage_pct=None if to_cage is None else to_cage * (line.deviation_pct or 0.0),
        cage_ci95_pct=None if to_cage is None else abs(to_cage) * (line.deviation_ci95_pct or 0.0),
        speed=analysis.speed,
        line=line,
        shown=shown,
        call=compare_with_baseline(analysis, healthy),
        caution="; ".join(note for note in recording.notes if note in special),
        cautions=recording.cautions,
    )


def healthy_analysis(
    recording: Recording,
    bearing: Bearing,
    registered: Sequence[RegisteredRecording],
    read: Baselines,
    band_hz: tuple[float, float] | None = None,
) -> Analysis | None:
    """The analysis of the healthy record that `recording` is compared with, if there is one; kept in `read`.

    In its data set's band, or in `band_hz` [Hz].
    """
    entry = healthy_baseline(recording, tuple(registered))
    if entry is None:
        return None
    key = entry.file, bearing.name, band_hz
    if key not in read:
        read[key] = analyse(load_entry(entry), bearing=bearing, band_hz=band_hz)
    return read[key]
