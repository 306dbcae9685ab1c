"""Amplitudes at the sensor, simulated with the scene `rig` and compared with the rig's records.

The path from ring to sensor is identified from records OR 877 and IR 877 (outer and inner race, 877 rpm). Quantities of
OR 877 are marked ``fit``, all others of the six records ``withheld``: known, but not fitted.

A case of the sweep simulates all records with one set of inputs and identifies the path again, so that common errors of
run and path cancel. The sets are the scene's inputs, the same with a finer step and more slices of each roller, and
random draws of all inputs and of the position of each record's defect.
"""

import itertools
import math
from argparse import Namespace
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.comparison.comparison import PRIOR, VERDICT
from srbval.errors import NumericsError
from srbval.models.run import Run
from srbval.path import amplitudes as read
from srbval.path.amplitudes import WHOLE_HZ
from srbval.path.identify import Pair, identify, line_order, record_behind_path
from srbval.path.locked import without_passage_lines
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.recordings import Recording, load_recording
from srbval.scene import Scene, SensorPath, draw_rig_changes, load_scene, merge, rig_inputs
from srbval.signal import NORMAL_95
from srbval.storage.installation import shipped_folder
from srbval.studies.harness import StudyResult
from srbval.sweep.pool import Attempt
from srbval.sweep.sweep import sweep

FOLDER, BEARING = shipped_folder("data_manifest/rig_excerpts"), load_bearing(DEFAULT_BEARING)
RPM, FAULTS = (877, 353), {"OR": Fault.OUTER, "IR": Fault.INNER, "Roller": Fault.ROLLER}
GAINS, RATIO = 0, 1  # positions of the records from which the path is identified
RUN = {"duration_s": 2.0, "solver": {"step_s": 1 / 61_440}}  # the scene's own step is too long for some contacts drawn
NOMINAL, FINER = "nominal", "finer"
CHANGES = {NOMINAL: {}, FINER: {"solver": {"step_s": 1 / 122_880}, "line_contact": {"slices": 31}}}
POWER, PATH_DRAWS, SEED = 4, 24, 23  # 2^POWER draws of the inputs
KINDS = {"locked": "locked level", "harmonic": "harmonic pattern", "total": "total level"}  # by first words
OWN_PARTS = ["reading", "mounting", "numerics", "path"]  # of the uncertainty of each band, independent of other bands


class RigRecord(NamedTuple):
    """Record of a fault on the rig, and the `healthy` record at the same speed.

    `order`: frequency of the fault's line over the shaft frequency; `detected`: true if this line was detected.
    """

    record: Recording
    healthy: Recording
    state: Fault
    order: float
    detected: bool

    def quantities(self, recording: Recording, order: float, added: Recording | None = None) -> read.Amplitudes:
        """Compared quantities of a recording, its fault line at `order`; total levels include the power of `added`."""
        found = read.totals(recording, added) | read.pattern(recording, BEARING, self.state, order)
        found |= read.locked_levels(recording, BEARING, order) if self.detected else {}
        return {name: value for name, value in found.items() if name.split()[0] in KINDS}


@cache
def rig_records() -> tuple[RigRecord, ...]:
    """Load all fault records with the lines of roller passages removed, highest speed first."""
    found = []
    for rpm, (code, state) in itertools.product(RPM, FAULTS.items()):
        record, healthy = (load_recording(FOLDER / f"{one}_{rpm}rpm_sample.h5") for one in (code, "H"))
        line = analyse(record, bearing=BEARING, band_hz=WHOLE_HZ).line_of(state)
        order = (line.found_hz or line.kinematic_hz) / record.known_speed.value_hz
        own, alone = (without_passage_lines(x, BEARING, at, WHOLE_HZ) for x, at in ((record, order), (healthy, None)))
        found.append(RigRecord(own, alone, state, order, line.detected))
    return tuple(found)


def scenes_of(case: Mapping[str, Any]) -> tuple[Scene, ...]:
    """Make the scenes of a case, one for each record: its speed and defect position, with the inputs of the case."""
    found, inputs = [], case["inputs"]
    for place, one in enumerate(rig_records()):
        if (changes := CHANGES.get(inputs)) is None:
            angles = draw_rig_changes(rig_inputs("position"), POWER + 3)
            changes = merge(draw_rig_changes(rig_inputs(), POWER)[int(inputs)], angles[place * 2**POWER + int(inputs)])
        own = {"shaft_speed_rad_s": 2 * math.pi * one.record.known_speed.value_hz, "defect": {"kind": one.state}}
        found.append(load_scene("rig", merge(own | RUN, changes)))
    return tuple(found)


def measure(case: Mapping[str, Any], *attempts: Attempt) -> dict[str, float]:
    """Levels at the sensor behind the path identified from the runs; for the nominal case with effects of the path."""
    if bad := [one for one in attempts if not one.works]:
        raise NumericsError(f"amplitudes: a run with {case['inputs']} inputs is {bad[0].status}: {bad[0].reason}")
    runs = [one.run for one in attempts if one.run is not None]
    pairs = (Pair(record=rig_records()[place].record, run=runs[place]) for place in (GAINS, RATIO))
    path = identify(*pairs, bearing=BEARING).path
    found = _levels_behind(runs, path)
    if case["inputs"] == NOMINAL:
        random = np.random.default_rng(SEED)
        moved = pd.DataFrame([_levels_behind(runs, path.drawn(random)) for _ in range(PATH_DRAWS)])
        found |= {f"path {name}": width for name, width in half_widths(moved).items()}
    return found


def _levels_behind(runs: Iterable[Run], path: SensorPath) -> dict[str, float]:
    found = {}
    for one, run in zip(rig_records(), runs, strict=True):
        order = line_order(run, BEARING)
        shown = without_passage_lines(record_behind_path(run, path), BEARING, order, WHOLE_HZ)
        for name, value in one.quantities(shown, order, one.healthy).items():
            found[f"{one.record.name} {name}"] = value.value
    return found


def half_widths(drawn: pd.DataFrame) -> pd.Series:
    """95 % half width of each column of `drawn` (one row per draw): its standard deviation times Student's t."""
    return drawn.std(ddof=1) * float(stdtrit(len(drawn) - 1, 0.975))


def rig_rows(mounting_db: float) -> pd.DataFrame:
    """Table of compared quantities of all rig records, with uncertainties [dB] of reading and sensor mounting."""
    rows = []
    for place, one in enumerate(rig_records()):
        alone, fit = read.totals(one.healthy), place == GAINS
        of = {"record": one.record.name, "state": one.state, "used_for": "fit" if fit else "withheld"}
        for name, value in one.quantities(one.record, one.order).items():
            shared = fit or name.startswith("harmonic")  # the path has a mounting too
            found: dict[str, Any] = {"kind": KINDS[name.split()[0]], "quantity": name, "rig": value.value}
            found |= {"rig_present": value.present, "least": value.least, "reading": value.ci95}
            found["healthy"] = alone[name].value if name in alone else math.nan
            rows.append(of | found | {"mounting": 0.0 if shared else math.sqrt(2) * NORMAL_95 * mounting_db})
    return pd.DataFrame(rows)


def compare(rig: pd.DataFrame, found: pd.DataFrame) -> pd.DataFrame:
    """Add model value, error and validation uncertainty U [dB] to the table `rig`; `found`: simulated levels by case.

    The error of a level hidden in the record's noise is the model's excess over the least level visible there.
    """
    names, cases = list(rig.record + " " + rig.quantity), found.set_index("inputs")
    nominal, finer = (cases.loc[case, names].to_numpy(float) for case in (NOMINAL, FINER))
    hidden = ~rig.rig_present & np.isfinite(rig["least"])
    error = np.where(hidden, np.maximum(nominal - rig["least"], 0.0), nominal - rig.rig)
    rows = rig.assign(
        scene="rig",
        unit="dB",
        model=nominal,
        error=error,
        within=np.abs(error) <= VERDICT.near_db,
        numerics=np.abs(finer - nominal),
        path=cases.loc[NOMINAL, [f"path {name}" for name in names]].to_numpy(float),
        inputs=half_widths(cases.drop([NOMINAL, FINER])[names].astype(float)).to_numpy(),
    )
    return rows.assign(uncertainty=np.sqrt((rows[[*OWN_PARTS, "inputs"]] ** 2).sum(axis=1)))


def count_within(rows: pd.DataFrame) -> dict[str, dict[str, int]]:
    """Count the quantities that were not fitted, by kind, and how many have an error of at most `VERDICT.near_db`.

    A power that repeats with the fault counts even if the record's noise hides it; a hidden harmonic does not count.
    """
    used, found = rows[(rows.used_for == "withheld") & (rows.rig_present | (rows.kind == KINDS["locked"]))], {}
    for name, kind in zip(("locked", "harmonics", "totals"), KINDS.values(), strict=True):
        of = used[used.kind == kind]
        found[name] = {"within": int(of.within.sum()), "of": len(of)}
    found["totals"]["healthy_alone"] = int(((of.healthy - of.rig).abs() <= VERDICT.near_db).sum())
    return found


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Simulate the test rig, compare vibration levels with its records, and test if the errors differ from zero."""
    cases = pd.DataFrame({"inputs": [NOMINAL, FINER, *map(str, range(2**POWER))]})
    found = sweep(cases, scenes_of, measure, task="amplitudes", jobs=options.jobs, progress=progress)
    scatter = read.mounting_scatter([(one.record, one.healthy) for one in rig_records()], PRIOR.mounting_db)
    rows = compare(rig_rows(scatter["scatter_db"]), found)
    locked = rows[(rows.kind == KINDS["locked"]) & (rows.rig_present | (rows.error > 0))]
    tests = read.separate_levels(locked, OWN_PARTS, found[~found.inputs.isin(CHANGES)]).to_dict("records")
    content = {"counts": count_within(rows), "mounting": scatter, "tests": tests, "rows": rows.to_dict("records")}
    text = f"within, by kind: {content['counts']}\n{text_rows(tests)}"
    return StudyResult(name="amplitudes", content=content, text=text)
