"""The ball bearing model beside the records of CWRU, MFPT and HIT-SM.

Each registered record of a race's defect whose bearing has [elements] is read as `srbval analyse` reads it, and so are
runs of the planar model at its speed, in its band. Errors are model less record; the model's value is the mean over
what is open, drawn together, and its part of the uncertainty what that scatters. Levels: `DRAWS` runs with the inputs
of `inputs.toml`, a Latin hypercube. Cage ratio: `srbval.comparison.cage_inputs`, since the model turns its cage by
the bearing's dimensions. The defect is CWRU's where the file's name says it (a hole of so many
thousandths of an inch across, 0.011 in deep: quoted from memory, not checked), else as large as its default. Nothing is
fitted. One record is one unit: bias is the mean error of a set, with Student's 95 % interval from five records on,
scatter its standard deviation.
"""

import math
import re
import statistics
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import bilinear, lfilter
from scipy.stats import qmc, t

from srbval.arrays import FloatArray
from srbval.bearing import RACE_DEFECTS, Fault, load_bearing
from srbval.comparison.cage_inputs import cage_inputs
from srbval.comparison.compared_quantities import cage_ratio, harmonic_level, sideband_level
from srbval.models.sensor import along_sensor
from srbval.models.simulate import Step, stored_run
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings import Origin, Recording, recording_from_run
from srbval.recordings.registry import FileStatus, RegisteredRecording, listing, load_entry, without_copies
from srbval.scene import Scene, paper_scene
from srbval.signal import NORMAL_95
from srbval.studies.harness import StudyResult, input_hashes
from srbval.studies.open_inputs import drawn, open_inputs

SETS = ("cwru", "mfpt", "hit-sm")
RATE_HZ = 51_200.0  # covers the sets' band up to 10 kHz
SECONDS = 1.5
LOAD_N = 500.0  # where the set states none: assumed
LEAST_RECORDS = 5  # below them no bias is claimed
Row = dict[str, Any]
SIZE = re.compile(r"_(?:IR|OR)0(\d\d)")  # of CWRU's names, in thousandths of an inch
DRAWS = 10
STRUCTURE = "structure."
INPUTS = open_inputs(Path(__file__).with_name("inputs.toml"))
QUANTITIES = {"cage ratio [%]": cage_ratio, "2nd [dB]": harmonic_level(2), "3rd [dB]": harmonic_level(3),
              "4th [dB]": harmonic_level(4), "sidebands [dB]": sideband_level}  # fmt: skip


def scene_of(recording: Recording, analysis: Analysis, fault: Fault) -> Scene:
    """The planar model's scene at the record's speed, with the defect that its file's name states."""
    size = SIZE.search(Path(recording.file or "").name)
    hole = {} if size is None else {"extent": f"{int(size[1]) / 1e3} in", "height": "-0.011 in"}
    return paper_scene(
        bearing=recording.bearing or "", shaft_speed_rad_s=2 * math.pi * analysis.speed.value_hz, duration_s=SECONDS,
        output_rate_hz=RATE_HZ, solver={"step_s": 1 / RATE_HZ}, load={"radial_n": recording.radial_n or LOAD_N},
        defect={"kind": fault} | hole,
    )  # fmt: skip


def changed(scene: Scene, shares: Sequence[float]) -> tuple[Scene, dict[str, float]]:
    """The scene with every input at its share, and those of the structure between its ring and the sensor."""
    at = [(one.keys[0].startswith(STRUCTURE), one, share) for one, share in zip(INPUTS, shares, strict=True)]
    structure = {one.keys[0].removeprefix(STRUCTURE): float(one.value(share)) for of_it, one, share in at if of_it}
    own = [(one, share) for of_it, one, share in at if not of_it]
    return drawn([one for one, _ in own], scene, [share for _, share in own])[0], structure


def resonating(
    samples: FloatArray, fs_hz: float, *, frequency_hz: float, damping_ratio: float, direct: float
) -> FloatArray:
    """What a sensor shows of a ring's accelerations [n] behind one resonance.

    The `direct` share of them, and the acceleration of a mass on a spring and damper that they drive, relative to the
    ring: s^2 / (s^2 + 2 zeta w s + w^2) (Ewins 2000, Modal Testing, sect. 2.5; quoted from memory, not checked).
    """
    w = 2 * fs_hz * math.tan(math.pi * frequency_hz / fs_hz)  # where the bilinear transform puts it back
    taps = bilinear([1.0, 0.0, 0.0], [1.0, 2 * damping_ratio * w, w * w], fs_hz)
    return np.asarray(direct * samples + lfilter(*taps, samples))


def read_run(scene: Scene, analysis: Analysis, structure: Mapping[str, float] | None = None) -> Analysis:
    """The model's run, behind the structure if there is one, read in the record's band."""
    run = stored_run(scene, step=Step.UNCHECKED)
    if structure is not None:
        run = replace(run, sensor_m_s2=resonating(along_sensor(run.acceleration_m_s2), RATE_HZ, **structure))
    low, high = analysis.processed.band_hz
    return analyse(recording_from_run(run), bearing=analysis.bearing, band_hz=(low, min(high, 0.45 * RATE_HZ)))


def rows_of(recording: Recording, dataset: str, fault: Fault) -> tuple[list[Row], Row]:
    """All quantities that both sides show, and the lines' strengths.

    A row has both sides, the run without changed inputs, the error, and its 95 % half widths.
    """
    analysis, file = analyse(recording, bearing=load_bearing(recording.bearing or "")), Path(recording.file or "").name
    scene, rows = scene_of(recording, analysis, fault), []
    shares = qmc.LatinHypercube(d=len(INPUTS), rng=np.random.default_rng(0)).random(DRAWS)
    nominal = read_run(scene, analysis)
    models = [read_run(own, analysis, structure) for own, structure in (changed(scene, one) for one in shares)]
    assert analysis.bearing.elements is not None
    cage = cage_inputs(analysis.bearing.elements)
    for quantity, read in QUANTITIES.items():
        rig, own = read(analysis, fault), read(nominal, fault)
        values = [side.value for side in (read(model, fault) for model in models) if side is not None]
        if rig is None or own is None or not rig.present or len(values) < 2:
            continue
        if read is cage_ratio:
            scale, value, inputs = 100 / rig.value, own.value * (1 + cage.shift), 100 * cage.ci95
        else:
            scale, value, inputs = 1.0, statistics.fmean(values), NORMAL_95 * statistics.stdev(values)
        reading, speed = scale * math.hypot(rig.ci95 or 0.0, own.ci95 or 0.0), scale * rig.speed_ci95
        rows.append({
            "dataset": dataset, "file": file, "fault": fault, "quantity": quantity, "model": value,
            "nominal": own.value, "record": rig.value, "error": (value - rig.value) * scale, "reading": reading,
            "speed": speed, "inputs": inputs, "uncertainty": math.hypot(reading, speed, inputs),
        })  # fmt: skip
    size = SIZE.search(file)
    strengths = [s for s in (strength(model, fault) for model in models) if s is not None]
    return rows, {
        "dataset": dataset, "file": file, "fault": fault, "mil": size and int(size[1]),
        "record_db": strength(analysis, fault), "model_db": statistics.fmean(strengths) if strengths else None,
    }  # fmt: skip


def strength(analysis: Analysis, fault: Fault) -> float | None:
    """Level of the fault's line in the acceleration [dB re 1 unit of it]; the squared envelope's, halved."""
    line = analysis.line_of(fault)
    return None if not line.depth else 10 * math.log10(line.depth * analysis.processed.scale**2)


def summary_of(rows: Sequence[Row]) -> Iterator[Row]:
    """Bias and scatter of each quantity by set, and the records within their uncertainty."""
    for name, quantity in sorted({(row["dataset"], row["quantity"]) for row in rows}):
        own = [row for row in rows if (row["dataset"], row["quantity"]) == (name, quantity)]
        errors = [row["error"] for row in own]
        scatter = statistics.stdev(errors) if len(own) > 1 else None
        wide = len(own) >= LEAST_RECORDS and scatter is not None
        yield {
            "dataset": name, "quantity": quantity, "records": len(own), "bias": statistics.fmean(errors),
            "ci95": t.ppf(0.975, len(own) - 1) * scatter / math.sqrt(len(own)) if wide and scatter else None,
            "scatter": scatter, "within": sum(abs(row["error"]) <= row["uncertainty"] for row in own),
        }  # fmt: skip


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    rows, trend, read = list[Row](), list[Row](), list[RegisteredRecording]()
    whole = [one for one in listing().recordings if one.status is FileStatus.OK and one.origin is Origin.MEASURED]
    known = without_copies(one for one in whole if one.dataset in SETS and one.state in RACE_DEFECTS)
    for number, entry in enumerate(known):
        progress(Path(entry.file).name, number / len(known))
        recording = load_entry(entry) if options.only in entry.file else None
        if recording and recording.bearing and load_bearing(recording.bearing).elements is not None:
            found, strengths = rows_of(recording, entry.dataset or "", Fault(entry.state or ""))
            read.append(entry)
            rows += found
            trend.append(strengths)
    progress("records", 1.0)
    summary = list(summary_of(rows))
    shown = ("dataset", "file", "quantity", "model", "record", "error", "uncertainty", "inputs")
    tables = (text_rows(rows, {key: key for key in shown}), *(text_rows(table) for table in (summary, trend) if table))
    return StudyResult(
        name=None if options.only else "ball_records", content={"rows": rows, "summary": summary, "trend": trend},
        text="\n\n".join(tables), inputs=input_hashes(*read),
    )  # fmt: skip
