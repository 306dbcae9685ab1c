"""The rig scene's amplitudes against the rig's, in m/s2, per record and band.

The path to the sensor is identified from the power that is locked to OR 877's fault, its directions from the sidebands
of IR 877: these are `fit`, everything else of the eight records `withheld`, not used but seen. Judged are the locked
power in third octaves, the harmonics of the line, and the total level of a band (the healthy record's and what the
model adds), beside the healthy record alone. The passage lines of the rig are taken out of records and runs alike.
What each part is worth is the same counted without it, by `settings.toml`. All was chosen with earlier counts known.

The inputs' ranges are drawn together, with where each record's hole may lie drawn for itself; for every draw, and for
the finer run, the path is identified again, so that what both share cancels as it does in use. The draws of each band
are stored: level and pattern of a record are tested apart with their covariance. What levels scatter by from one
mounting to the next is read from the records themselves and is in U; other sets that repeat anything stand beside it.

And what a surface does to the healthy bearing's level: the scene with surfaces of classes and heights against H 877, to
which nothing was fitted, so that any height is; a class reaches waves of 1 to 50 mm by the power law alone.
"""

import itertools
import math
import statistics
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.comparison.bias import biases
from srbval.comparison.budget import PRIOR, VERDICT
from srbval.comparison.comparison import DATA_PARTS, MOUNTING, Comparison, QuantityValue
from srbval.comparison.effects import INPUTS
from srbval.comparison.verdicts import holm_adjusted
from srbval.models.run import Run
from srbval.path.amplitudes import (
    DB,
    LEVEL_BANDS,
    RMS_BANDS,
    THIRD_OCTAVES,
    WHOLE_HZ,
    band_power,
    levels,
    locked_levels,
    pattern,
)
from srbval.path.identify import Pair, behind, identify, line_order
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.reading.locked import without_passage_lines
from srbval.recordings import Recording, RecordingSettings
from srbval.recordings.registry import listing, load_entry
from srbval.scene import SensorPath, draws, merge, rig_inputs
from srbval.signal import NORMAL_95
from srbval.storage.tables import read_toml
from srbval.studies.amplitudes.counts import LOCKED, TOTAL, counts, healthy_errors
from srbval.studies.harness import StudyResult, input_hashes
from srbval.studies.level_and_pattern import draws_covariance, level_and_pattern, mounting_scatter
from srbval.studies.rig_amplitudes import (
    BEARING,
    FAST,
    FINER,
    NUMERICS,
    OF_HEALTHY,
    PATH,
    RATIOS,
    SEED,
    SLOW,
    crps,
    drawn_paths,
    half_widths,
    kind_of,
    measured,
    measured_entry,
    rows,
    run_of,
    scaling,
    values,
    with_background,
)

FAULTS, FITTED = (Fault.OUTER, Fault.INNER, Fault.ROLLER), (Fault.OUTER, FAST)
RIGS = 2000  # simulated, for the chances of a level and a pattern
POWER, HEALTHY_DRAWS = 4, 4  # of two: draws of all inputs; how many of them the healthy bearing is run with
LEVEL = "band level"
CLASSES, HEIGHTS_NM = ("N1", "N3"), (14.0, 28.0, 56.0)  # of surfaces, on every body
Row = dict[str, Any]
Key = tuple[Fault, float]
Values = Mapping[str, QuantityValue]


@dataclass(frozen=True, kw_only=True)
class Setting:
    """How all is predicted: `changes` of the scene, passage lines `out`, the path's two `directions` and its band."""

    name: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    out: bool = True
    directions: bool = True
    band_hz: tuple[float, float] = WHOLE_HZ


AS_IT_IS = Setting(name="as it is")
SETTINGS = (AS_IT_IS, *(Setting(**one) for one in read_toml(Path(__file__).with_name("settings.toml"))["setting"]))
MEAN = "mean over the draws of all inputs in place of the scene's own"


@dataclass(frozen=True, kw_only=True, eq=False)
class RigRecord:
    """A faulty record and the healthy one of its speed; the order of its line, and whether that was detected."""

    record: Recording
    healthy: Recording
    state: Fault
    order: float
    detected: bool
    used_for: str

    def without_lines(self) -> "RigRecord":
        """Both without their passage lines."""
        return replace(
            self, record=without_passage_lines(self.record, BEARING, self.order, WHOLE_HZ),
            healthy=without_passage_lines(self.healthy, BEARING, None, WHOLE_HZ),
        )  # fmt: skip

    def rig(self, mounting_db: float) -> dict[str, QuantityValue]:
        """What the record shows."""
        locked = locked_levels(self.record, BEARING, self.order) if self.detected else {}
        read = pattern(self.record, BEARING, self.state, self.order)
        return locked | levels(self.record, self.healthy, mounting_db) | totals(self.record) | read

    def model(self, run: Run, path: SensorPath, *, out: bool) -> dict[str, QuantityValue]:
        """What a run shows behind a path: depth and kurtosis in the healthy record's background, over it in total."""
        order, shown = line_order(run, BEARING), behind(run, path)
        if out:
            shown = without_passage_lines(shown, BEARING, order, WHOLE_HZ)
        noisy = pattern(with_background(shown, self.healthy), BEARING, self.state, order)
        of_noise = {name: value for name, value in noisy.items() if kind_of(name) in RATIOS}
        locked = locked_levels(shown, BEARING, order) if self.detected else {}
        read = pattern(shown, BEARING, self.state, order)
        return locked | levels(shown, None) | totals(shown, self.healthy) | read | of_noise


def totals(recording: Recording, beside: Recording | None = None) -> dict[str, QuantityValue]:
    """Total level of each third octave [dB re 1 m/s2], with the power of another record added."""
    found = {}
    for name, band in LEVEL_BANDS.items():
        power = band_power(recording, band) + (band_power(beside, band) if beside else 0.0)
        ci95 = NORMAL_95 * DB / math.sqrt((band[1] - band[0]) * recording.seconds)
        found[f"total {name}"] = QuantityValue(value=DB * math.log(power), ci95=ci95)
    return found


def rig_records() -> dict[Key, RigRecord]:
    """All faulty records, the fast ones first; the order of a line by its own record."""
    found = {}
    for speed, state in itertools.product((FAST, SLOW), FAULTS):
        record = measured(state, speed)
        line = analyse(record, bearing=BEARING, band_hz=WHOLE_HZ).line_of(state)
        assert record.speed is not None
        found[state, speed] = RigRecord(
            record=record, healthy=measured(Fault.HEALTHY, speed), state=state, detected=line.detected,
            order=(line.found_hz or line.kinematic_hz) / record.speed.value_hz,
            used_for="fit" if (state, speed) == FITTED else "withheld",
        )  # fmt: skip
    return found


def mounting(records: Mapping[Key, RigRecord]) -> Row:
    """Scatter of one mounting's levels by third octaves in which a faulty record is quieter than its healthy one [dB].

    `quieter`: in how many of all bands; `most_db`: by how much at most.
    """
    off = [
        (DB * math.log(band_power(one.record, band) / band_power(one.healthy, band)),
         DB * math.sqrt(2 / ((band[1] - band[0]) * one.record.seconds)))
        for one in records.values() for band in LEVEL_BANDS.values()
    ]  # fmt: skip
    quieter = np.array([pair for pair in off if pair[0] < 0]).reshape(-1, 2)
    mean, low, high = mounting_scatter(quieter[:, 0], quieter[:, 1], PRIOR.mounting_db)
    most = float(-quieter[:, 0].min()) if quieter.size else 0.0
    return {
        "scatter_db": mean, "ci95_db": [low, high], "quieter": len(quieter), "bands": len(off), "most_db": most
    }  # fmt: skip


# Records of other rigs that repeat something: of the same faulty bearing in another session (CWRU's two sampling
# rates, probably not mounted anew in between: a lower bound), and of like bearings at four places of one shaft (IMS,
# healthy: places and sensors differ too, an upper one).
REPEATS: Mapping[str, Sequence[Sequence[tuple[str, str]]]] = {
    "CWRU, the same bearing in two sessions": [
        [("105_IR007_0_12kDE.mat", "DE"), ("109_IR007_0_48kDE.mat", "DE")],
        [("130_OR007at6_0_12kDE.mat", "DE"), ("135_OR007at6_0_48kDE.mat", "DE")],
        [("169_IR014_0_12kDE.mat", "DE"), ("174_IR014_0_48kDE.mat", "DE")],
    ],
    "IMS, four like healthy bearings on one shaft": [
        [("2003.10.22.12.06.24", f"ch{number}") for number in (1, 3, 5, 7)],
    ],
}  # fmt: skip


def repeats() -> Iterator[Row]:
    """Standard deviation of the third octaves' levels within each group of `REPEATS` [dB], of those at hand."""
    entries = {Path(one.file).name: one for one in listing().recordings}
    for name, groups in REPEATS.items():
        variances = []
        for group in (group for group in groups if all(file in entries for file, _ in group)):
            of = [load_entry(replace(entries[file], settings=RecordingSettings(channel=one))) for file, one in group]
            own = [[DB * math.log(band_power(one, band)) for band in LEVEL_BANDS.values()] for one in of]
            variances.append(np.var(own, axis=0, ddof=1))
        if variances:
            yield {"set": name, "groups": len(variances), "scatter_db": float(np.sqrt(np.mean(variances)))}


def paths_of(records: Mapping[Key, RigRecord], runs: Mapping[Key, Sequence[Run]], setting: Setting) -> list[SensorPath]:
    """The path of each run of OR 877, its directions by the run of IR 877 with the same inputs."""
    outer, inner = (
        [Pair(record=records[state, FAST].record, run=run) for run in runs[state, FAST]]
        for state in (Fault.OUTER, Fault.INNER)
    )
    both = zip(outer, inner if setting.directions else [None] * len(outer), strict=True)
    return [identify(own, cross, bearing=BEARING, band_hz=setting.band_hz).path for own, cross in both]


def judge(
    one: RigRecord, rig: Values, runs: Sequence[Run], paths: Sequence[SensorPath], setting: Setting, mounting_db: float
) -> tuple[tuple[Comparison, ...], list[dict[str, float]]]:
    """Rows of a record, and what each draw of the inputs shows; `runs`: nominal, finer, draws, each with its path.

    Of the nominal run alone without parts of the uncertainty but the rig's.
    """
    model, *others = (one.model(run, path, out=setting.out) for run, path in zip(runs, paths, strict=True))
    off = math.sqrt(2) * NORMAL_95 * mounting_db * (one.used_for == "withheld")  # two mountings: the path has one too
    parts = {MOUNTING: {name: off for name in rig if kind_of(name) in (LOCKED, TOTAL, LEVEL)}}
    drawn = [values(other) for other in others[1:]]
    if drawn:
        moved = [one.model(runs[0], path, out=setting.out) for path in drawn_paths(paths[0])]
        parts[NUMERICS] = {name: abs(others[0][name].value - value.value) for name, value in model.items()}
        parts[PATH] = half_widths([values(other) for other in moved])
        parts[INPUTS] = half_widths(drawn)
    return rows(rig, model, parts, record=one.record.name, fault=one.state, used_for=one.used_for), drawn


def tested_apart(found: Sequence[Comparison], drawn: Sequence[Mapping[str, float]]) -> Row | None:
    """Level and pattern of a record's locked bands by the covariance of the draws; None without two such bands.

    A covariance of few draws makes the p of either too small: they are the shares of `RIGS` simulated right models that
    are as far off, each by the covariance of as many draws of its own (parametric bootstrap: Davison & Hinkley 1997).
    `normal_p` has what they would be by theory, level first.
    """
    used = [row for row in found if row.kind == LOCKED and (row.rig.present or row.error > 0)]
    if len(used) < 2:
        return None
    own = [math.hypot(*(part for name, part in row.parts.items() if name != INPUTS)) / NORMAL_95 for row in used]
    levels_db = np.array([[draw[row.quantity] for row in used] for draw in drawn])
    covariance = draws_covariance(levels_db, own)
    result = level_and_pattern([row.error for row in used], covariance)
    random, zero = np.random.default_rng(SEED), np.zeros(len(used))
    as_far = np.zeros(2)
    for error in random.multivariate_normal(zero, covariance, RIGS):
        again = random.multivariate_normal(zero, np.cov(levels_db, rowvar=False), len(drawn))
        other = level_and_pattern(error, draws_covariance(again, own))
        as_far += abs(other.level / other.u) >= abs(result.level / result.u), other.d2 >= result.d2
    level_p, pattern_p = ((1 + as_far) / (1 + RIGS)).tolist()
    return {
        "record": used[0].record, "used_for": used[0].used_for, **vars(result),
        "level_p": level_p, "pattern_p": pattern_p, "normal_p": (result.level_p, result.pattern_p),
    }  # fmt: skip


def band_row(row: Comparison) -> Row:
    """A locked band as the table shows it; `halves_db`: how much the record's own halves differ, None by noise."""
    halves = row.rig.halves
    apart = None if halves is None or not np.isfinite(halves).all() else float(abs(halves[1] - halves[0]))
    return {
        "record": row.record, "used_for": row.used_for, "band": row.quantity.removeprefix("locked "),
        "rig_db": row.rig.value if row.rig.present else row.rig.least, "model_db": row.model.value,
        "error_db": row.error, "u95_db": row.uncertainty, "halves_db": apart, "censored": not row.rig.present,
        "within": abs(row.error) <= VERDICT.near_db,
    }  # fmt: skip


def healthy_totals(records: Mapping[Key, RigRecord]) -> dict[str, dict[str, float]]:
    """Total levels of the healthy record of each faulty record's speed [dB re 1 m/s2], by the faulty record's name."""
    return {one.record.name: values(totals(one.healthy)) for one in records.values()}


def scores(found: Sequence[Comparison], alone: Sequence[float]) -> Row:
    """Mean CRPS of the withheld totals [dB], of the model with its own uncertainty and of the healthy record alone."""
    of = [row for row in found if row.kind == TOTAL and row.used_for == "withheld"]
    own = [math.hypot(*(v for part, v in row.parts.items() if part not in DATA_PARTS)) / NORMAL_95 for row in of]
    model = [crps(row.error, u) for row, u in zip(of, own, strict=True)]
    return {"model": statistics.fmean(model), "healthy alone": statistics.fmean(map(abs, alone))}


def healthy_rows(changes: Sequence[Mapping[str, Any]], paths: Sequence[SensorPath]) -> Iterator[Comparison]:
    """The healthy bearing's own levels at both speeds, and by how much they rise from one to the other."""
    sides: dict[float, tuple[Values, list[dict[str, QuantityValue]]]] = {}
    for speed in (FAST, SLOW):
        record = measured(Fault.HEALTHY, speed)
        runs = [run_of(record, Fault.HEALTHY, one) for one in changes]
        read = [levels(behind(run, path), None) for run, path in zip(runs, paths, strict=False)]
        moved = [values(levels(behind(runs[0], path), None)) for path in drawn_paths(paths[0])]
        sides[speed] = levels(record, None), read
        parts = _parts(read) | {PATH: half_widths(moved)}
        yield from rows(
            sides[speed][0], read[0], parts, record=record.name, fault=Fault.HEALTHY, used_for="withheld"
        )  # fmt: skip
    (fast_rig, fast_model), (slow_rig, slow_model) = sides[FAST], sides[SLOW]
    rise = [scaling(slow, fast) for slow, fast in zip(slow_model, fast_model, strict=True)]
    name = " to ".join(measured(Fault.HEALTHY, speed).name for speed in (SLOW, FAST))
    yield from rows(
        scaling(slow_rig, fast_rig), rise[0], _parts(rise), record=name, fault=Fault.HEALTHY, used_for="withheld"
    )


def _parts(read: Sequence[Values]) -> dict[str, dict[str, float]]:
    model, finer, *drawn = read
    return {
        NUMERICS: {name: abs(finer[name].value - value.value) for name, value in model.items()},
        INPUTS: half_widths([values(one) for one in drawn]),
    }


def surfaces(record: Recording, path: SensorPath) -> Row:
    """RMS per band [m/s2] of the healthy record and of the scene with each surface; its levels over the record [dB]."""
    made: Row = {name: {"roughness_class": name} for name in CLASSES}
    for nm in HEIGHTS_NM:
        made[f"{nm:g} nm"] = {f"{body}_waviness_m": nm * 1e-9 for body in ("outer", "inner", "roller")}
    theirs = values(levels(record, None))
    rms, over = [{"surface": f"{record.name}, measured", **_rms(record), "status": ""}], list[Row]()
    for name, surface in {"round": {}, **made}.items():
        run = run_of(record, Fault.HEALTHY, {"surface": surface, "seed": 1} if surface else {})
        shown = behind(run, path)
        own = values(levels(shown, None))
        apart = {band: own[band] - theirs[band] for band in THIRD_OCTAVES}
        rms.append({"surface": name, **_rms(shown), "status": run.status.value})
        over.append({"surface": name, **apart, "mean dB": statistics.fmean(apart.values())})
    return {"rms": rms, "model_over_record_db": over}


def _rms(recording: Recording) -> dict[str, float]:
    return {name: math.sqrt(band_power(recording, band)) for name, band in RMS_BANDS.items()}


def study(progress: Progress) -> Row:
    """All that is stored."""
    raw = rig_records()
    records = {key: one.without_lines() for key, one in raw.items()}
    scatter, healthy = mounting(records), healthy_totals(records)
    common, places = draws(rig_inputs(), POWER), iter(draws(rig_inputs("position"), POWER + 3))
    runs = dict[Key, list[Run]]()
    for i, (key, one) in enumerate(records.items()):
        progress("runs of the scene", i / len(records))
        changes = [{}, FINER, *(merge(inputs, next(places)) for inputs in common)]
        runs[key] = [run_of(one.record, one.state, change) for change in changes]
    paths = paths_of(records, runs, AS_IT_IS)
    found, average = list[Comparison](), list[Comparison]()
    drawn, tests, worth = list[Row](), list[Row](), list[Row]()
    for i, (key, one) in enumerate(records.items()):
        progress("comparisons", i / len(records))
        rig = one.rig(scatter["scatter_db"])
        own, by_draw = judge(one, rig, runs[key], paths, AS_IT_IS, scatter["scatter_db"])
        found += own
        means = {name: QuantityValue(value=statistics.fmean(draw[name] for draw in by_draw)) for name in by_draw[0]}
        average += rows(rig, means, {}, record=one.record.name, fault=one.state, used_for=one.used_for)
        drawn += [{"record": one.record.name} | {n: v for n, v in of.items() if kind_of(n) == LOCKED} for of in by_draw]
        tested = tested_apart(own, by_draw)
        tests += [tested] if tested else []
    for setting in SETTINGS:
        progress(f"counts: {setting.name}", 0.0)
        of = records if setting.out else raw
        nominal = {key: own[:1] for key, own in runs.items()}
        if setting.changes:
            nominal = {key: [run_of(one.record, one.state, setting.changes)] for key, one in of.items()}
        (path,) = paths_of(of, nominal, setting)
        compared = [
            row for key, one in of.items()
            for row in judge(one, one.rig(scatter["scatter_db"]), nominal[key], [path], setting, 0.0)[0]
        ]  # fmt: skip
        worth.append({"setting": setting.name, **counts(compared, healthy_totals(of))})
    worth.append({"setting": MEAN, **counts(average, healthy)})
    at_rest = list(healthy_rows([{}, FINER, *common[:HEALTHY_DRAWS]], paths))
    counted = [
        replace(row, kind=OF_HEALTHY) if row.state is Fault.HEALTHY and row.kind == LEVEL else row
        for row in (*found, *at_rest) if row.kind != LEVEL or row.quantity in THIRD_OCTAVES  # each band once
    ]  # fmt: skip
    for test, p in zip(tests, holm_adjusted([one["pattern_p"] for one in tests]).tolist(), strict=True):
        test["pattern_p_holm"] = p
    return {
        "counts": worth[0], "worth": worth, "bands": [band_row(row) for row in found if row.kind == LOCKED],
        "level_and_pattern": tests, "mounting": scatter | {"elsewhere": list(repeats())},
        "crps_db": scores(found, healthy_errors(found, healthy)),
        "path": vars(paths[0]),
        "comparisons": [row.to_dict() for row in (*found, *at_rest)], "bias": biases(counted), "draws": drawn,
        "surfaces": surfaces(measured(Fault.HEALTHY, FAST), paths[0]),
    }  # fmt: skip


def run(_: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    content = study(progress)
    text = "\n\n".join(text_rows(content[part]) for part in ("bands", "level_and_pattern", "worth"))
    states = itertools.product((FAST, SLOW), (Fault.HEALTHY, *FAULTS))
    inputs = input_hashes(*(measured_entry(state, speed) for speed, state in states))
    return StudyResult(name="amplitudes", content=content, text=text, inputs=inputs)
