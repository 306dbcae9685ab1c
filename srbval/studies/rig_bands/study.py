"""Does one band serve model and rig, and which combs near BPFO do the records carry? Needs the 877 rpm recordings.

The scene `rig`, the paper's scene and the rig's recordings at the recordings' speeds, each demodulated from the paper's
band for simulated signals and from its band for the rig, by the one pipeline. And of every record of the rig at that
speed, band by band, the order of the strongest comb within 1 % of BPFO, by the tachometer's speed, and its power over
noise. A comb of the shaft, of a transmission or of the drive would have one order in all records; a cage's wanders.
"""

import math
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from srbval.bearing import DEFAULT_BEARING, RACE_DEFECTS, Fault, load_bearing
from srbval.check.quantities import RIG_RPM
from srbval.comparison.compared_quantities import harmonic_level
from srbval.comparison.speed_and_slip import published_rpm
from srbval.models.run import Run
from srbval.models.simulate import Step, stored_run
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.recordings import Recording, recording_from_run
from srbval.recordings.registry import load_entry, rig_recordings
from srbval.scene import load_scene
from srbval.studies.harness import StudyResult, input_hashes
from srbval.studies.rig_amplitudes import measured, measured_entry

RIG_BAND_HZ = (1400.0, 2800.0)  # the paper's for the rig, section 5
BANDS = (SIMULATED_BAND_HZ, RIG_BAND_HZ)
# The paper's bands and what lies above, cut at the drive's tones near 4 and 8 kHz.
COMB_BANDS_HZ = (
    (500.0, 1400.0), RIG_BAND_HZ, (3000.0, 4000.0), (4500.0, 6500.0), (6500.0, 7900.0), (8900.0, 9900.0),
)  # fmt: skip
SCENES = {"rig": "rig scene", "paper": "paper's scene"}
RIG = "rig, measured"
STATES = (Fault.HEALTHY, *RACE_DEFECTS)
SECONDS = 2.0  # as long as the recordings
HARMONICS = range(2, 6)  # those that the pipeline reads
BEARING = load_bearing(DEFAULT_BEARING)
Row = dict[str, Any]


def in_both_bands(side: str, state: Fault, record: Recording) -> Iterator[Row]:
    """One record's readings: RMS and, of a fault's record, its line.

    `order` over the shaft with its 95 % half width `ci95`, power over noise `snr`, whether it was `detected`;
    `harmonics_db` 2 to 5 over the first in the squared envelope, None where out of reach.
    """
    assert record.unit == "m/s2", "or the sides' RMS cannot be compared"
    for band_hz in BANDS:
        found = analyse(record, bearing=BEARING, band_hz=band_hz)
        hz, line = found.speed.value_hz, None if state is Fault.HEALTHY else found.line_of(state)
        heights = [] if line is None else [harmonic_level(number)(found, state) for number in HARMONICS]
        yield {
            "side": side, "state": state.value, "rpm": 60 * hz, "band_hz": list(found.processed.band_hz),
            "rms_m_s2": found.processed.scale * float(np.sqrt(np.mean(found.processed.filtered**2))),
            "line": line and line.name, "order": line and line.found_hz and line.found_hz / hz,
            "ci95": line and line.ci95_hz and line.ci95_hz / hz, "snr": line and line.snr,
            "detected": line is not None and line.detected,
            "harmonics_db": [None if height is None else height.value for height in heights],
        }  # fmt: skip


def simulated(scene: str, state: Fault) -> Run:
    """A run of a bundled scene at the mean speed of the rig's record of that state, with steps as fine as it takes."""
    rpm, _ = published_rpm(state, RIG_RPM)
    own = {"defect": {"kind": state}, "shaft_speed": f"{rpm} rpm", "duration_s": SECONDS}
    return stored_run(load_scene(scene, own), step=Step.AUTO).require_usable(f"rig bands: {scene}, {state}: the run")


def served(rows: Sequence[Mapping[str, Any]], side: str) -> bool:
    """Does `RIG_BAND_HZ` show every fault of a side where the other band shows it?

    That is: the line is detected, and lies where the other band has it, as far as both readings' intervals tell.
    """
    own = {(row["state"], tuple(row["band_hz"])): row for row in rows if row["side"] == side}

    def same(state: Fault) -> bool:
        pair = [own[state.value, band] for band in BANDS]
        if any(row["order"] is None or row["ci95"] is None or not row["detected"] for row in pair):
            return False
        one, other = pair
        return bool(abs(one["order"] - other["order"]) <= math.hypot(one["ci95"], other["ci95"]))

    return all(map(same, RACE_DEFECTS))


def combs() -> Iterator[Row]:
    """One of each of the rig's records and bands."""
    for entry in rig_recordings(nominal_rpm=RIG_RPM):
        recording = load_entry(entry)
        for band in COMB_BANDS_HZ:
            analysis = analyse(recording, bearing=BEARING, band_hz=band)
            line, turn_hz = analysis.line("BPFO"), analysis.speed.value_hz
            if line.found_hz is not None and line.ci95_hz is not None:
                yield {
                    "record": recording.state, "low_hz": band[0], "high_hz": band[1], "order": line.found_hz / turn_hz,
                    "ci95": line.ci95_hz / turn_hz, "snr": line.snr, "detected": line.detected,
                }  # fmt: skip


def run(_: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    rows, power_w = list[Row](), dict[str, float]()
    for number, state in enumerate(STATES):
        progress("run and read", number / len(STATES))
        rows += in_both_bands(RIG, state, measured(state, RIG_RPM))
        for scene, side in SCENES.items():
            run = simulated(scene, state)
            rows += in_both_bands(side, state, recording_from_run(run))
            if state is Fault.HEALTHY:
                power_w[side] = float(run.energy.drive_w.mean())
    progress("run and read", 1.0)
    sides, found = {side: served(rows, side) for side in (RIG, *SCENES.values())}, list(combs())
    content = {
        "seconds": SECONDS, "drive_w": power_w, "band_hz": RIG_BAND_HZ, "served": sides, "rows": rows, "combs": found,
    }  # fmt: skip
    inputs = input_hashes(*(measured_entry(state, RIG_RPM) for state in STATES), *rig_recordings(nominal_rpm=RIG_RPM))
    text = f"{text_rows(rows)}\n{power_w} {sides}\n\n{text_rows(found)}"
    return StudyResult(name="rig_bands", content=content, text=text, inputs=inputs)
