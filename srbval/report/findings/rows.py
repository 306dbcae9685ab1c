"""The rows of ``report.json`` that follow from the findings: comparisons, Table 6, sum rule, cage ratios."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from srbval.bearing import Fault
from srbval.comparison.cage_means import CageMeans, cage_means
from srbval.comparison.cage_readings import CageReading
from srbval.comparison.compared_quantities import RACE_LINE, biases
from srbval.comparison.comparison import Row, comparison_frame, deviation_pct, rows_of
from srbval.comparison.counterpart import AnalysedRun
from srbval.comparison.table6 import measured_rows, published_rows, published_speeds, sum_rules
from srbval.comparison.verdicts import holds, joint_tests, trend_pct, verdicts
from srbval.models.run import Run
from srbval.recordings.manifest import RegisteredRecording
from srbval.recordings.registry import RegisterListing
from srbval.report.findings.findings import Findings
from srbval.report.findings.records import sideband_shares
from srbval.signal import NORMAL_95
from srbval.validation.compare import LINES, PAIR_KEYS

if TYPE_CHECKING:
    import pandas as pd

SCHEMA_VERSION = 1
MIDDLE = (0.025, 0.5, 0.975)  # of a distribution: the ends of its 95 % interval and its median


def compared_rows(
    found: Findings,
    models: Mapping[Fault, AnalysedRun],
    register: RegisterListing,
    registered: Sequence[RegisteredRecording],
) -> dict[str, Any]:
    """The keys of ``report.json`` that follow from the findings and from the register."""
    printed, bearing, runs = found.printed, found.bearing, found.runs
    every, pairs = compared(found.validation.comparisons), found.validation.pairs.to_dict("records")
    shown = {rig.recording.file or rig.recording.name for rig in found.analyses["rig"].values()}
    comparisons = every[every["record"].isin(shown)]
    model_runs = {state: side.run for state, side in models.items()}
    paper, rig = (found.analyses[side] for side in ("paper", "rig"))
    stored = found.results.content("inputs")
    healthy = runs["paper-healthy"]
    radial_n, share = healthy.scene.load.radial_n, healthy.roller_load_share
    spring_n = math.hypot(*(healthy.displacement_m.mean(axis=0))) * healthy.scene.housing.stiffness_n_m
    load_path = {"radial_n": radial_n, "spring_n": spring_n, "roller_n": share * radial_n, "roller_load_share": share}
    lines = [*published_rows(printed, paper, runs), *measured_rows(rig, model_runs, comparisons)]
    keys = dict.fromkeys(key for one in lines for key in one)
    rows, means = verdicts(found.cage_readings, stored), cage_means(found.cage_readings)
    return {
        "schema_version": SCHEMA_VERSION,
        "status": "ok",
        "headline": {"holds": holds(rows), "verdicts": rows},
        "verdicts": rows,
        "cage_readings": found.cage_readings,
        "cage_ratios": list(cage_ratio_rows(found.cage_readings, means, stored, bearing.orders.ftf)),
        "trend": trend(means, rows),
        "joint_tests": list(joint_tests(found.cage_readings, stored)),
        "table6": [keys | row for row in lines],  # a value that a row does not have is None
        "closure": tuple(sum_rules(printed, paper, runs, rig)),
        "comparisons": rows_of(comparisons),
        "pairs": pairs,
        "line_deviations": list(line_deviations(pairs, found.validation.comparisons)),
        "published_speeds": list(published_speed_rows()),
        "recordings": tuple(registered),
        "recordings_not_used": [
            {"file": Path(r.file).name, "status": r.status.value, "reason": r.reason or ""} for r in register.problems
        ],
        "register_unreadable": register.unreadable or None,
        "bias": biases(every, used_for="withheld"),
        "sensitivity": list(found.known.values()),
        "sidebands": {name: sideband_shares(found.analyses[name][Fault.INNER]) for name in ("model", "rig")},
        "load_path": load_path,
        "point_passing": point_passing(healthy),
        "kept_results": {name: result.origin for name, result in found.results.items()},
        "runs": found.run_facts,
        "cautions": cautions(pairs),
    }


def compared(rows: Iterable[Row]) -> "pd.DataFrame":
    """Comparisons of both sides of the records whose fault line is detected, without the line itself.

    The cage ratio has the same information in a form whose errors may be averaged over both races.
    """
    frame = comparison_frame(rows)
    lines = frame[frame["kind"].isin([one.kind for one in LINES]) & frame["rig_present"].astype(bool)]
    kept = frame["pair"].isin(lines["pair"]) & (frame["kind"] != RACE_LINE.kind) & frame["error"].notna()
    return frame[kept].sort_values("pair", kind="stable").drop(columns=list(PAIR_KEYS))


def line_deviations(pairs: Iterable[Row], comparisons: Iterable[Row]) -> Iterator[Row]:
    """Deviation of the race line of each measured record from pure rolling at the record's own shaft speed [%]."""
    speed_source = {one["pair"]: one["measured_facts"]["shaft_from"] for one in pairs}
    for row in comparisons:
        if row["kind"] == RACE_LINE.kind and row["rig_present"]:
            found = {"record": Path(row["record"]).stem, "line": Fault(row["state"]).line}
            found |= {"speed_source": speed_source[row["pair"]], "slip_ci95_pct": row["data_ci95"]}
            yield found | {"slip_pct": deviation_pct(row["rig"], row["kinematic"])}


def cautions(pairs: Iterable[Row]) -> list[dict[str, str]]:
    """Cautions on the recordings that this report uses: each file and caution once."""
    once = dict.fromkeys((Path(p["measured"][0]).name, one) for p in pairs for one in p["measured_facts"]["cautions"])
    return [{"file": file, "caution": caution} for file, caution in once]


def published_speed_rows() -> Iterator[dict[str, Any]]:
    """Mean tachometer speed of each state's published record, and its deviation from the outer-race record's."""
    means = {(mean.state, mean.nominal_rpm): mean.mean_rpm for mean in published_speeds().means}
    for state, rpm in sorted(means, key=lambda key: (list(Fault).index(key[0]), key[1])):
        mean = means[state, rpm]
        from_outer_pct = deviation_pct(mean, means[Fault.OUTER, rpm])
        yield {"state": state, "nominal_rpm": rpm, "mean_rpm": mean, "from_outer_pct": from_outer_pct}


def cage_ratio_rows(
    readings: Sequence[CageReading], means: CageMeans, stored: Mapping[str, Any], kinematic: float
) -> Iterator[Row]:
    """Rows of `cage_ratio_plot`: for each nominal speed the records, their mean, the scenes, kinematics."""
    for place, rpm in enumerate(means.rpm):
        for one in (one for one in readings if one.nominal_rpm == rpm):
            half = NORMAL_95 * float(np.hypot(one.reading_u, one.speed_u))
            yield _row("record", rpm, (one.ratio - half, one.ratio, one.ratio + half), one.state.code)
        yield _row("mean", rpm, np.quantile(means.draws[:, place], MIDDLE))
        for variant in stored.get("variants", ()):
            own = [one["drawn"] for one in variant["records"] if one["nominal_rpm"] == rpm]
            if own:
                yield _row(variant["scene"], rpm, np.quantile(np.mean(own, axis=0), MIDDLE))
        yield _row("kinematics", rpm, (kinematic,) * 3)


def _row(of: str, rpm: float, interval: Iterable[float], state: str = "") -> Row:
    low, ratio, high = map(float, interval)
    return {"of": of, "state": state, "nominal_rpm": rpm, "ratio": ratio, "low": low, "high": high}


def trend(means: CageMeans, rows: Iterable[Row]) -> Row:
    """Change of the cage ratio from the fastest to the slowest speed [%]: of the rig, and of scene ``rig`` if known."""
    rig, ci95 = trend_pct(means)
    name = f"{means.rpm[0]:g} less {means.rpm[-1]:g} rpm"
    own = next((one for one in rows if (one["scene"], one["endpoint"]) == ("rig", name)), None)
    return {
        "endpoint": name,
        "records": list(means.records),
        "rig_pct": rig,
        "rig_ci95_pct": ci95,
        "between_records_pct": 100 * means.between_u / means.means[-1],
        "between_records_ci95_pct": [100 * end / means.means[-1] for end in means.between_ci95],
        "model_pct": own and rig + own["error_pct"],
        "u_pct": own and own["u_pct"],
        "verdict": own and own["verdict"],
    }


def point_passing(run: Run) -> dict[str, float]:
    """Frequencies at which rollers pass the points of the raceways in a run, numerical [Hz]."""
    points, shaft_hz = run.scene.contact.points_per_circle, run.scene.shaft_hz
    return {
        "points_per_circle": points,
        "shaft_rpm": 60 * shaft_hz,
        "outer_hz": points * run.cage_ratio * shaft_hz,
        "inner_hz": points * (1 - run.cage_ratio) * shaft_hz,
    }
