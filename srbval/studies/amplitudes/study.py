"""Amplitudes at the sensor, simulated with the scene `rig` and compared with the rig's records.

The gains of the vibration path from ring to sensor are identified from the fault-locked power (the part that repeats
with the fault's passages) of record OR 877 (outer race, 877 rpm), the ratio of the gains along and across the load from
the sidebands of IR 877 (inner race). Quantities of OR 877 are marked ``fit``, all others of the six records
``withheld``: known, but not fitted. The simulated total level includes the power of the measured healthy record.

A case of the sweep simulates all records with one set of inputs and identifies the path again, so that common errors of
run and path cancel. The sets are the scene's own inputs, the same with a finer step and more slices of each roller, and
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

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.comparison.comparison import PRIOR, VERDICT
from srbval.errors import NumericsError
from srbval.models.run import Run
from srbval.path import amplitudes as read
from srbval.path.amplitudes import WHOLE_HZ
from srbval.path.identify import Pair, identify, line_order
from srbval.path.identify import record_behind_path as behind
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.reading.locked import without_passage_lines
from srbval.recordings import Recording, load_recording
from srbval.scene import Scene, SensorPath, load_scene, merge, rig_inputs
from srbval.scene import draw_rig_changes as draws
from srbval.signal import NORMAL_95
from srbval.storage.installation import shipped_folder
from srbval.studies.harness import StudyResult
from srbval.sweep.pool import Attempt
from srbval.sweep.sweep import sweep

BEARING = load_bearing(DEFAULT_BEARING)
FOLDER, BEARING = shipped_folder("data_manifest/rig_excerpts"), load_bearing(DEFAULT_BEARING)
RPM, FAULTS = (877, 353), {Fault.OUTER: "OR", Fault.INNER: "IR", Fault.ROLLER: "Roller"}
GAINS, RATIO = 0, 1  # positions of the records from which the path is identified
SECONDS, STEP_S = 2.0, 1 / 61_440  # for the longest contacts drawn the scene's own step is too long
NOMINAL, FINER = "nominal", "finer"
CHANGES = {NOMINAL: {}, FINER: {"solver": {"step_s": STEP_S / 2}, "line_contact": {"slices": 31}}}
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
    shaft_hz: float
    order: float
    detected: bool

    def quantities(
        self, recording: Recording, order: float, added: Recording | None = None
    ) -> dict[str, read.Amplitude]:
        """Compared quantities of a recording, its fault line at `order`; total levels include the power of `added`."""
        found = read.totals(recording, added) | read.pattern(recording, BEARING, self.state, order)
        found |= read.locked_levels(recording, BEARING, order) if self.detected else {}
        return {name: value for name, value in found.items() if name.split()[0] in KINDS}


@cache
def rig_records() -> tuple[RigRecord, ...]:
    """Load all fault records with the lines of roller passages removed, highest speed first."""
    found = []
    for rpm, (state, code) in itertools.product(RPM, FAULTS.items()):
        healthy, record = (load_recording(FOLDER / f"{name}_{rpm}rpm_sample.h5") for name in ("H", code))
        line, shaft_hz = analyse(record, bearing=BEARING, band_hz=WHOLE_HZ).line_of(state), record.known_speed.value_hz
        order = (line.found_hz or line.kinematic_hz) / shaft_hz
        own, alone = (
            without_passage_lines(one, BEARING, at, WHOLE_HZ) for one, at in ((record, order), (healthy, None))
        )
        found.append(RigRecord(own, alone, state, shaft_hz, order, line.detected))
    return tuple(found)


def scenes_of(case: Mapping[str, Any]) -> tuple[Scene, ...]:
    """Make the scenes of a case, one for each record: its speed and defect position, with the inputs of the case."""
    found, inputs = [], case["inputs"]
    for place, one in enumerate(rig_records()):
        if (changes := CHANGES.get(inputs)) is None:
            angles = draws(rig_inputs("position"), POWER + 3)
            changes = merge(draws(rig_inputs(), POWER)[int(inputs)], angles[place * 2**POWER + int(inputs)])
        speed = {"shaft_speed_rad_s": 2 * math.pi * one.shaft_hz}
        own = speed | {"defect": {"kind": one.state}, "duration_s": SECONDS, "solver": {"step_s": STEP_S}}
        found.append(load_scene("rig", merge(own, changes)))
    return tuple(found)


def measure(case: Mapping[str, Any], *attempts: Attempt) -> dict[str, float]:
    """Compute the levels at the sensor behind the path that is identified from the runs `attempts`.

    The nominal case also gets their half widths due to the uncertainty of the path.
    """
    for one in attempts:
        if not one.works:
            raise NumericsError(f"amplitudes: a run with {case['inputs']} inputs is {one.status}: {one.reason}")
    runs, records = [one.run for one in attempts if one.run is not None], rig_records()
    pairs = [Pair(record=records[place].record, run=runs[place]) for place in (GAINS, RATIO)]
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
        shown = without_passage_lines(behind(run, path), BEARING, order, WHOLE_HZ)
        for name, value in one.quantities(shown, order, one.healthy).items():
            found[f"{one.record.name} {name}"] = value.value
    return found


def half_widths(drawn: pd.DataFrame) -> pd.Series:
    """95 % half width of each column of `drawn` (one row per draw): its standard deviation times Student's t."""
    from scipy.special import stdtrit

    return drawn.std(ddof=1) * float(stdtrit(len(drawn) - 1, 0.975))


def rig_rows(mounting_db: float) -> pd.DataFrame:
    """Table of compared quantities of all rig records, with uncertainties [dB] of reading and sensor mounting."""
    rows = []
    for place, one in enumerate(rig_records()):
        alone = read.totals(one.healthy)
        fit = place == GAINS
        for name, value in one.quantities(one.record, one.order).items():
            kind, shared = KINDS[name.split()[0]], fit or name.startswith("harmonic")  # the path has a mounting too
            of: dict[str, Any] = {"record": one.record.name, "state": one.state.value, "kind": kind, "quantity": name}
            of |= {"used_for": "fit" if fit else "withheld", "rig": value.value, "rig_present": value.present}
            of |= {"least": value.least, "healthy": alone[name].value if name in alone else math.nan}
            off = 0.0 if shared else math.sqrt(2) * NORMAL_95 * mounting_db
            rows.append(of | {"reading": value.ci95, "mounting": off})
    return pd.DataFrame(rows)


def compare(rig: pd.DataFrame, found: pd.DataFrame) -> pd.DataFrame:
    """Add model value, error and validation uncertainty U [dB] to the table `rig`; `found`: simulated levels by case.

    If a level of the record is hidden in its noise, the error is the model's excess over the least level
    that would be visible in this noise.
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
    locked, harmonics, totals = (rows[(rows.kind == kind) & (rows.used_for == "withheld")] for kind in KINDS.values())
    of_kind = {"locked": locked, "harmonics": harmonics[harmonics.rig_present], "totals": totals}
    found = {name: {"within": int(of.within.sum()), "of": len(of)} for name, of in of_kind.items()}
    found["totals"]["healthy_alone"] = int(((totals.healthy - totals.rig).abs() <= VERDICT.near_db).sum())
    return found


def separate_levels(rows: pd.DataFrame, drawn: pd.DataFrame) -> pd.DataFrame:
    """Split each record's errors in its frequency bands into a weighted mean (``level``) and the rest (the pattern).

    The errors are of the power that repeats with the fault [dB]. Student's t distribution tests if their mean is zero,
    the chi-squared distribution if the pattern is zero. `drawn` contains the powers simulated with random inputs, for
    the covariance of the errors. With few such simulations the probability of the pattern is too small.
    """
    from scipy.special import chdtrc, stdtr

    tests = []
    used = rows[(rows.kind == KINDS["locked"]) & (rows.rig_present | (rows.error > 0))]
    for (record, used_for), of in used.groupby(["record", "used_for"], sort=False):
        if len(of) > 1:
            own_u = np.sqrt((of[OWN_PARTS] ** 2).sum(axis=1)).to_numpy() / NORMAL_95
            covariance = np.cov(drawn[list(of.record + " " + of.quantity)].to_numpy(float), rowvar=False)
            level, u, d2 = read.level_and_pattern(of.error.to_numpy(), covariance + np.diag(own_u**2))
            found = {"record": record, "used_for": used_for, "bands": len(of), "level": level, "u": u, "d2": d2}
            chances = {"level_p": 2 * stdtr(len(drawn) - 1, -abs(level / u)), "pattern_p": chdtrc(len(of) - 1, d2)}
            tests.append(found | chances)
    return pd.DataFrame(tests)


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Simulate the test rig, compare vibration levels with its records, and test if the errors differ from zero."""
    cases = pd.DataFrame({"inputs": [NOMINAL, FINER, *map(str, range(2**POWER))]})
    found = sweep(cases, scenes_of, measure, task="amplitudes", jobs=options.jobs, progress=progress)
    scatter = read.mounting_scatter([(one.record, one.healthy) for one in rig_records()], PRIOR.mounting_db)
    rows = compare(rig_rows(scatter["scatter_db"]), found)
    tests = separate_levels(rows, found[~found.inputs.isin(CHANGES)]).to_dict("records")
    content = {"counts": count_within(rows), "mounting": scatter, "tests": tests, "rows": rows.to_dict("records")}
    text = [f"{kind}: {of}" for kind, of in content["counts"].items()]
    return StudyResult(name="amplitudes", content=content, text="\n".join([*text, text_rows(tests)]))
