"""The ball bearing model beside the records of CWRU, MFPT and HIT-SM: ``python -m tests.calibrators.ball_records``.

Each registered record of a race's defect whose bearing has [elements] is read as `srbval analyse` reads it, and so is a
run of the planar model at its speed, in its band. Errors are model less record. What the sets do not say is open and
goes into the uncertainty as half the span of runs at its ends: the radial load (half and twice), the housing's damping
(a third and three times), the clearance (none and 20 um). The defect is CWRU's where the file's name says it (a
hole of so many thousandths of an inch across, 0.011 in deep: quoted from memory, not checked), else as large as its
default. Nothing is fitted. One record is one unit: bias is the mean error of a set, scatter its standard deviation.
"""

from __future__ import annotations

import argparse
import math
import re
import statistics
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.bearing import RACE_DEFECTS, Fault, load_bearing
from srbval.cli.output import print_json, print_table
from srbval.models.simulate import Step, simulate
from srbval.recordings import Recording
from srbval.recordings.load import recording_from_run
from srbval.recordings.registry import listing
from srbval.recordings.registry.lookup import load_entry
from srbval.scene import paper_scene
from srbval.validation.analyse import Analysis, analyse
from srbval.validation.compared_quantities import cage_ratio, harmonic_level, sideband_level
from srbval.validation.other_rigs import usable

SETS = ("cwru", "mfpt", "hit-sm")
RATE_HZ = 51_200.0  # covers the sets' band up to 10 kHz
SECONDS = 2.0
LOAD_N = 500.0  # where the set states none: assumed
SIZE = re.compile(r"_(?:IR|OR)0(\d\d)")  # of CWRU's names, in thousandths of an inch
QUANTITIES = {"cage ratio [%]": cage_ratio, "2nd [dB]": harmonic_level(2), "3rd [dB]": harmonic_level(3),
              "4th [dB]": harmonic_level(4), "sidebands [dB]": sideband_level}  # fmt: skip
OPEN: tuple[Mapping[str, float], ...] = ({}, {"load": 0.5}, {"load": 2.0}, {"damping": 1 / 3}, {"damping": 3.0},
                                         {"play_m": 2e-5})  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Row:
    """One quantity of one record: both sides, error and its 95 % uncertainty, of which `inputs` are the model's."""

    dataset: str
    file: str
    fault: Fault
    quantity: str
    model: float
    record: float
    error: float
    uncertainty: float
    inputs: float
    detected: bool


def model_of(recording: Recording, analysis: Analysis, fault: Fault, change: Mapping[str, float]) -> Analysis:
    """The planar model's run at the record's speed, read in the record's band."""
    name = recording.bearing or ""
    size = SIZE.search(Path(recording.file or "").name)
    hole = {} if size is None else {"extent": f"{int(size[1]) / 1e3} in", "height": "-0.011 in"}
    base = paper_scene(bearing=name)
    load = (recording.radial_n or LOAD_N) * change.get("load", 1.0)
    scene = paper_scene(
        bearing=name, shaft_speed_rad_s=2 * math.pi * analysis.speed.value_hz, duration_s=SECONDS,
        output_rate_hz=RATE_HZ, solver={"step_s": 1 / RATE_HZ}, load={"radial_n": load}, defect={"kind": fault} | hole,
        contact={"radial_play_m": change.get("play_m", 0.0)},
        housing={"damping_ns_m": base.housing.damping_ns_m * change.get("damping", 1.0)},
    )  # fmt: skip
    run = simulate(scene, step=Step.UNCHECKED)
    low, high = analysis.processed.band_hz
    return analyse(recording_from_run(run), bearing=load_bearing(name), band_hz=(low, min(high, 0.45 * RATE_HZ)))


def rows_of(recording: Recording, dataset: str, fault: Fault) -> Iterator[Row]:
    """All quantities that both sides show."""
    analysis = analyse(recording, bearing=load_bearing(recording.bearing or ""))
    models = [model_of(recording, analysis, fault, change) for change in OPEN]
    for quantity, read in QUANTITIES.items():
        rig, sides = read(analysis, fault), [read(model, fault) for model in models]
        values = [side.value for side in sides if side is not None]
        if rig is None or sides[0] is None or not rig.present:
            continue
        scale = 100 / rig.value if read is cage_ratio else 1.0
        inputs = (max(values) - min(values)) / 2 * scale
        parts = (rig.ci95 or 0.0, rig.speed_ci95, sides[0].ci95 or 0.0)
        yield Row(
            dataset=dataset, file=Path(recording.file or "").name, fault=fault, quantity=quantity, model=values[0],
            record=rig.value, error=(values[0] - rig.value) * scale,
            uncertainty=math.hypot(*(part * scale for part in parts), inputs), inputs=inputs, detected=rig.present,
        )  # fmt: skip


def strength(analysis: Analysis, fault: Fault) -> float | None:
    """Level of the fault's line in the acceleration [dB re 1 unit of it]; the squared envelope's, halved."""
    line = analysis.line_of(fault)
    return None if not line.depth else 10 * math.log10(line.depth * analysis.processed.scale**2)


def compare(only: str) -> tuple[list[Row], list[dict[str, Any]]]:
    """Rows of all records whose name holds `only`, and the lines' strengths by defect size on CWRU's drive end."""
    rows, trend = [], []
    for entry in usable(listing().recordings):
        if entry.dataset not in SETS or entry.state not in RACE_DEFECTS or only not in entry.file:
            continue
        recording, fault = load_entry(entry), Fault(entry.state)
        if recording.bearing is None or load_bearing(recording.bearing).elements is None:
            continue
        print(entry.file, file=sys.stderr, flush=True)
        rows += list(rows_of(recording, entry.dataset, fault))
        size = SIZE.search(Path(entry.file).name)
        if size is not None and "12kDE" in entry.file:
            analysis = analyse(recording, bearing=load_bearing(recording.bearing))
            model = model_of(recording, analysis, fault, {})
            trend.append({"file": Path(entry.file).name, "fault": fault, "mil": int(size[1]),
                          "record_db": strength(analysis, fault), "model_db": strength(model, fault)})  # fmt: skip
    return rows, trend


def main() -> None:
    """Print errors, then bias and scatter by set, then the trend with the defect's size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--only", default="", help="part of the files' names")
    options = parser.parse_args()
    rows, trend = compare(options.only)
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.dataset, row.quantity), []).append(row)
    summary = [
        {"dataset": name, "quantity": quantity, "records": len(own),
         "bias": statistics.fmean(r.error for r in own),
         "scatter": statistics.stdev(r.error for r in own) if len(own) > 1 else None,
         "within": sum(abs(r.error) <= r.uncertainty for r in own)}
        for (name, quantity), own in sorted(groups.items())
    ]  # fmt: skip
    if options.json:
        print_json({"rows": [vars(r) for r in rows], "summary": summary, "trend": trend})
        return
    print_table(("set", "file", "quantity", "model", "record", "error", "± 95 %"),
                [(r.dataset, r.file, r.quantity, r.model, r.record, r.error, r.uncertainty) for r in rows])  # fmt: skip
    print()
    print_table(tuple(summary[0]) if summary else (), [tuple(one.values()) for one in summary])
    print()
    print_table(("file", "fault", "mil", "record dB", "model dB"), [tuple(one.values()) for one in trend])


if __name__ == "__main__":
    main()
