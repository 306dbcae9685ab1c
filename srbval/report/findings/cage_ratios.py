"""The cage ratio of the rig's records beside those of the scenes: the report's first picture, and the trend."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from srbval.comparison.budget import STATED
from srbval.comparison.cage_means import CageMeans, cage_means
from srbval.comparison.cage_readings import CageReading
from srbval.comparison.verdicts import Row, Verdict, joint_tests, second_looks, trend_pct
from srbval.signal import NORMAL_95

MIDDLE = (0.025, 0.5, 0.975)


def cage_ratio_rows(
    readings: Sequence[CageReading], means: CageMeans, stored: Mapping[str, Any], kinematic: float
) -> Iterator[Row]:
    """By nominal speed: each record, their mean, each scene as it is stated, kinematics; see `cage_ratio_plot`."""
    for place, rpm in enumerate(means.rpm):
        for one in (one for one in readings if one.nominal_rpm == rpm):
            half = NORMAL_95 * float(np.hypot(one.reading_u, one.speed_u))
            yield _row("record", rpm, (one.ratio - half, one.ratio, one.ratio + half), one.state.code)
        yield _row("mean", rpm, np.quantile(means.draws[:, place], MIDDLE))
        for variant in stored.get("variants", ()):
            own = [one["drawn"] for one in variant["records"] if one["nominal_rpm"] == rpm]
            if own and variant["form"] == STATED:
                yield _row(variant["scene"], rpm, np.quantile(np.mean(own, axis=0), MIDDLE))
        yield _row("kinematics", rpm, (kinematic,) * 3)


def _row(of: str, rpm: float, interval: Iterable[float], state: str = "") -> Row:
    low, ratio, high = map(float, interval)
    return {"of": of, "state": state, "nominal_rpm": rpm, "ratio": ratio, "low": low, "high": high}


def trend(means: CageMeans, rows: Iterable[Verdict]) -> Row:
    """How much the cage ratio changes from the fastest speed to the slowest [%]: rig, and the scene ``rig``.

    The model's values are None without its stored draws.
    """
    rig, ci95 = trend_pct(means)
    name = f"{means.rpm[0]:g} less {means.rpm[-1]:g} rpm"
    own = next((one for one in rows if (one.scene, one.form, one.endpoint) == ("rig", STATED, name)), None)
    return {
        "endpoint": name, "records": list(means.records), "rig_pct": rig, "rig_ci95_pct": ci95,
        "between_records_pct": 100 * means.between_u / means.means[-1],
        "between_records_ci95_pct": [100 * end / means.means[-1] for end in means.between_ci95],
        "model_pct": own and rig + own.error_pct, "u_pct": own and own.u_pct, "verdict": own and own.verdict,
    }  # fmt: skip


def cage_data(
    readings: Sequence[CageReading], stored: Mapping[str, Any], rows: Sequence[Verdict], kinematic: float
) -> dict[str, Any]:
    """The keys of ``report.json`` that follow from the records' readings and the model's `stored` draws."""
    means = cage_means(readings)
    return {
        "cage_readings": readings,
        "cage_ratios": list(cage_ratio_rows(readings, means, stored, kinematic)),
        "trend": trend(means, rows),
        "joint_tests": list(joint_tests(readings, stored)),
        "second_look": list(second_looks(readings, stored)),
    }
