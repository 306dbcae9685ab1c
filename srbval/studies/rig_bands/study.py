"""Does one band serve model and rig? Needs the rig's 877 rpm recordings.

The scene `rig`, the paper's scene and the rig's recordings at the recordings' speeds, each demodulated from the paper's
band for simulated signals and from its band for the rig, by the one pipeline.
"""

import math
from argparse import Namespace
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from srbval.bearing import DEFAULT_BEARING, RACE_DEFECTS, Fault, load_bearing
from srbval.check.quantities import RIG_RPM
from srbval.comparison.compared_quantities import harmonic_level
from srbval.comparison.speed_and_slip import published_speeds
from srbval.errors import DataError, NumericsError
from srbval.models.run import Run
from srbval.models.simulate import Step, simulate
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.recordings import Recording, recording_from_run
from srbval.recordings.registry import find_recording, load_entry
from srbval.scene import load_scene
from srbval.studies.harness import Study, StudyResult

RIG_BAND_HZ = (1400.0, 2800.0)  # the paper's for the rig, section 5
BANDS = (SIMULATED_BAND_HZ, RIG_BAND_HZ)
SCENES = {"rig": "rig scene", "paper": "paper's scene"}
RIG = "rig, measured"
STATES = (Fault.HEALTHY, *RACE_DEFECTS)
SECONDS = 2.0  # as long as the recordings
HARMONICS = range(2, 6)  # those that the pipeline reads


@dataclass(frozen=True, kw_only=True)
class BandReading:
    """One record in one band: RMS there and, of a fault's, its line.

    `order` over the shaft with its 95 % half width `ci95`, power over noise `snr`, whether it was `detected`;
    `harmonics_db` 2 to 5 over the first in the squared envelope, None where out of reach.
    """

    side: str
    state: Fault
    rpm: float
    band_hz: tuple[float, float]
    rms_m_s2: float
    line: str | None = None
    order: float | None = None
    ci95: float | None = None
    snr: float | None = None
    detected: bool = False
    harmonics_db: tuple[float | None, ...] = ()


def band_reading(side: str, state: Fault, found: Analysis) -> BandReading:
    """What the table shows of one analysis."""
    processed, speed_hz = found.processed, found.speed.value_hz
    assert found.recording.unit == "m/s2", "or the sides' RMS cannot be compared"
    read = BandReading(
        side=side, state=state, rpm=60 * speed_hz, band_hz=processed.band_hz,
        rms_m_s2=processed.scale * float(np.sqrt(np.mean(processed.filtered**2))),
    )  # fmt: skip
    if state is Fault.HEALTHY:
        return read
    line = found.line_of(state)
    levels = (harmonic_level(number)(found, state) for number in HARMONICS)
    fields = asdict(read) | {
        "line": line.name, "snr": line.snr, "detected": line.detected,
        "order": line.found_hz and line.found_hz / speed_hz, "ci95": line.ci95_hz and line.ci95_hz / speed_hz,
        "harmonics_db": tuple(None if level is None else level.value for level in levels),
    }  # fmt: skip
    return BandReading(**fields)


def recorded(state: Fault) -> Recording:
    """The rig's recording of a state."""
    entry = find_recording(state=state, nominal_rpm=RIG_RPM)
    if entry is None:
        raise DataError(f"no {state} recording at {RIG_RPM:g} rpm is registered; srbval data fetch torino-excerpts.")
    return load_entry(entry)


def simulated(scene: str, state: Fault) -> Run:
    """A run of a bundled scene at the mean speed of the rig's record of that state, with steps as fine as it takes."""
    means = published_speeds().means
    rpm = next(mean.mean_rpm for mean in means if (mean.state, mean.nominal_rpm) == (state, RIG_RPM))
    own = {"defect": {"kind": state}, "shaft_speed": f"{rpm} rpm", "duration_s": SECONDS}
    run = simulate(load_scene(scene, own), step=Step.AUTO)
    if not run.status.usable:
        raise NumericsError(f"rig bands: {scene}, {state}: the run failed ({run.status}): {run.reason}")
    return run


def in_both_bands(side: str, state: Fault, record: Recording) -> Iterator[BandReading]:
    """One record's readings."""
    bearing = load_bearing(DEFAULT_BEARING)
    for band in BANDS:
        yield band_reading(side, state, analyse(record, bearing=bearing, band_hz=band))


def served(rows: Sequence[BandReading], side: str) -> bool:
    """Does `RIG_BAND_HZ` show every fault of a side where the other band shows it?

    That is: the line is detected, and lies where the other band has it, as far as both readings' intervals tell.
    """
    own = {(row.state, row.band_hz): row for row in rows if row.side == side}

    def same(state: Fault) -> bool:
        one, other = own[state, RIG_BAND_HZ], own[state, SIMULATED_BAND_HZ]
        if None in (one.order, other.order, one.ci95, other.ci95) or not (one.detected and other.detected):
            return False
        return abs((one.order or 0.0) - (other.order or 0.0)) <= math.hypot(one.ci95 or 0.0, other.ci95 or 0.0)

    return all(same(state) for state in RACE_DEFECTS)


def _run(_: Namespace, progress: Progress) -> StudyResult:
    rows, power_w = list[BandReading](), dict[str, float]()
    for number, state in enumerate(STATES):
        progress("run and read", number / len(STATES))
        rows += in_both_bands(RIG, state, recorded(state))
        for scene, side in SCENES.items():
            run = simulated(scene, state)
            rows += in_both_bands(side, state, recording_from_run(run))
            if state is Fault.HEALTHY:
                power_w[side] = float(run.energy.drive_w.mean())
    progress("run and read", 1.0)
    sides = {side: served(rows, side) for side in (RIG, *SCENES.values())}
    content = {"seconds": SECONDS, "drive_w": power_w, "band_hz": RIG_BAND_HZ, "served": sides, "rows": rows}
    text = f"{text_rows([asdict(row) for row in rows])}\n{power_w} {sides}"
    return StudyResult(name="rig_bands", content=content, text=text)


STUDY = Study(question="Does one band serve model and rig?", minutes=2, run=_run)
