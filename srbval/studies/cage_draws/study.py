"""Cage ratio of the model at draws of its inputs that all records share: the paper's scene, other forms of it, `rig`.

Every draw is run at the speeds of the rig's records, without a defect and with one on either race, so that a
difference between records or speeds has the spread of the difference, in which what they share cancels. What is one
thing in steel is drawn once. One input after the other is run over its range as well, all else nominal. ASME V&V 20
calls the spread u_input; the verdicts on model and rig are made of it, see `srbval.comparison.verdicts`.
"""

import math
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from srbval.bearing import RACE_DEFECTS, Fault
from srbval.comparison.budget import FORMS, STATED, Form
from srbval.comparison.comparison import deviation_pct
from srbval.comparison.counterpart import converged, with_points
from srbval.comparison.speed_and_slip import published_speeds
from srbval.errors import NumericsError
from srbval.models.simulate import Step, simulate
from srbval.progress import Progress, silent
from srbval.progress.tables import text_rows
from srbval.scene import RigInput, Scene, changes_at, load_scene, merge, paper_scene, rig_inputs, sobol, values_at
from srbval.studies.harness import StudyResult
from srbval.studies.open_inputs import BAND, OpenInput, drawn, open_inputs
from srbval.sweep.pool import side_by_side

TURNS = 3.0  # of the shaft: the ratio differs from that of thirty by less than 1e-5 of it
# The rig's scene: twelve passages; the ratio differs from that of two seconds by less than 1e-6 of it. Its own step is
# beyond the stiffest roller's limit where contacts are longest.
RIG_RUN = {"settle_s": 0.05, "duration_s": 0.1, "solver": {"step_s": 1 / 61_440}}
# Of two: draws of all inputs together, by the scene and its form; fewer of forms that are no answer of their own.
POWERS = {("paper", STATED): 6, ("rig", STATED): 7}
OTHER_POWER = 5
POINTS, LOG_POINTS = 3, 9  # values of one input of the paper's scene; over decades an effect rises and falls
FINE_SLICES = 61


@dataclass(frozen=True, kw_only=True)
class _Input:
    """What the result says of an input: name, unit, the shares of its range that are tried alone, their values."""

    name: str
    unit: str
    shares: tuple[float, ...]
    value: Callable[[float], float | str]


@dataclass(frozen=True, kw_only=True)
class _Variant:
    """A form of a scene and its inputs; `scene_at` gives its scene at shares, of None the nominal one, for a record."""

    scene: str
    form: str
    inputs: Sequence[_Input]
    scene_at: Callable[[Mapping[str, Any], Sequence[float | None]], Scene]


def variants() -> Iterator[_Variant]:
    """The paper's scene in every form that `budget.toml` names, and the scene ``rig``."""
    for form in FORMS:
        opened = [
            replace(one, low=form.ranges[one.name][0], high=form.ranges[one.name][1])
            if one.name in form.ranges
            else one
            for one in open_inputs()
            if not one.keys[0].startswith(BAND)  # which is the reading's
        ]
        shown = [
            _Input(name=one.name, unit="of nominal" if one.relative else "", shares=_shares(one), value=one.value)
            for one in opened
        ]
        yield _Variant(scene="paper", form=form.name, inputs=shown, scene_at=partial(_paper_at, form, opened))
    listed = rig_inputs()
    ranges = [
        _Input(name=one.key, unit=one.unit, shares=one.shares, value=partial(_rig_value, listed, one.key))
        for one in listed
    ]
    yield _Variant(scene="rig", form=STATED, inputs=ranges, scene_at=partial(_rig_at, listed))


def _rig_shares(listed: Sequence[RigInput], shares: Iterable[float | None]) -> list[float]:
    return [one.nominal_share if share is None else share for one, share in zip(listed, shares, strict=True)]


def _rig_value(listed: Sequence[RigInput], key: str, share: float) -> float:
    """Value of an input, all else nominal."""
    return values_at(listed, _rig_shares(listed, [share if one.key == key else None for one in listed]))[key]


def _rig_at(listed: Sequence[RigInput], record: Mapping[str, Any], shares: Sequence[float | None]) -> Scene:
    own = {"defect": {"kind": record["state"]}, "shaft_speed": f"{record['shaft_rpm']} rpm"}
    return load_scene("rig", merge(merge(own, RIG_RUN), changes_at(listed, _rig_shares(listed, shares))))


def _shares(one: OpenInput) -> tuple[float, ...]:
    """Of the probability: every choice, or evenly from one end to the other."""
    if one.choices:
        return tuple(sum(one.weights[:place]) for place in range(len(one.choices)))
    return tuple(np.linspace(0, 1, LOG_POINTS if one.log else POINTS).tolist())


def _paper_at(
    form: Form, inputs: Sequence[OpenInput], record: Mapping[str, Any], shares: Sequence[float | None]
) -> Scene:
    nominal = converged(
        paper_scene(
            shaft_speed_rad_s=2 * math.pi * record["shaft_rpm"] / 60, duration_s=60 * TURNS / record["shaft_rpm"],
            defect={"kind": record["state"]}, **form.changes,
        )
    )  # fmt: skip
    given = [(one, share) for one, share in zip(inputs, shares, strict=True) if share is not None]
    return drawn([one for one, _ in given], nominal, [share for _, share in given])[0]


def cage_ratio(scene: Scene) -> float:
    """Of a run, NaN where it failed. Its step is not checked: that is part of the study."""
    run = simulate(scene, step=Step.UNCHECKED)
    return round(run.cage_ratio, 8) if run.status.usable else math.nan


def finer(scene: Scene) -> Scene:
    """Half the step, and twice the points on a circle or more slices along a roller."""
    halved = replace(scene, solver=replace(scene.solver, step_s=scene.solver.step_s / 2))
    if scene.model == "slices":
        return replace(halved, line_contact=replace(scene.line_contact, slices=FINE_SLICES))
    return with_points(halved, 2 * scene.contact.points_per_circle)


def records() -> list[dict[str, Any]]:
    """State and mean speed of the rig's published records; one with a defect on a roller is the healthy bearing's.

    Such a defect lowers the cage ratio of the paper's scene by 2e-5 of it (0.431498 for 0.431507 at 353 rpm).
    """
    return [
        {"state": mean.state.value, "nominal_rpm": mean.nominal_rpm, "shaft_rpm": mean.mean_rpm}
        for mean in published_speeds().means
        if mean.state in (Fault.HEALTHY, *RACE_DEFECTS)
    ]


def run_variant(
    one: _Variant, of: Sequence[Mapping[str, Any]], *, power: int, jobs: int | None = None, progress: Progress = silent
) -> dict[str, Any]:
    """All runs of a variant for the records `of`.

    Values of the inputs at which the run of any record failed are left out for all of them, and counted; a nominal run
    that fails is a `NumericsError`.
    """
    none: list[float | None] = [None] * len(one.inputs)
    at: list[list[float | None]] = [[*row] for row in sobol(len(one.inputs), power)]
    alone = [(i, share) for i, own in enumerate(one.inputs) for share in own.shares]
    asked = [none, *([*none[:i], share, *none[i + 1 :]] for i, share in alone), *at]
    scenes = {(r, n): one.scene_at(record, shares) for r, record in enumerate(of) for n, shares in enumerate(asked)}
    scenes |= {(r, -1): finer(scenes[r, 0]) for r in range(len(of))}
    found = side_by_side(
        scenes, lambda key, _: cage_ratio(scenes[key]), task=f"{one.scene}, {one.form}", jobs=jobs, progress=progress
    )
    ratios = np.array([[found[r, n] for n in range(len(asked))] for r in range(len(of))])
    kept = np.isfinite(ratios).all(axis=0)
    if not kept[0] or not all(math.isfinite(found[r, -1]) for r in range(len(of))):
        raise NumericsError(f"cage draws: a nominal run of {one.scene}, {one.form}, failed.")
    effects = []
    for i, own in enumerate(one.inputs):
        places = [n for n, (which, _) in enumerate(alone, start=1) if which == i and kept[n]]
        shares = [alone[n - 1][1] for n in places]
        effects.append({
            "name": own.name, "unit": own.unit, "shares": shares, "values": [own.value(share) for share in shares],
            "ratios": ratios[:, places].tolist(),
        })  # fmt: skip
    drawn_at = 1 + len(alone) + np.flatnonzero(kept[1 + len(alone) :])
    return {
        "scene": one.scene, "form": one.form, "failed": int(np.count_nonzero(~kept)),
        "records": [
            {**record, "nominal": found[r, 0], "finer": found[r, -1], "drawn": ratios[r, drawn_at].tolist()}
            for r, record in enumerate(of)
        ],
        "effects": effects, "at": np.array([asked[n] for n in drawn_at], dtype=float).round(6).tolist(),
    }  # fmt: skip


def summary_rows(variant: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Of every record: nominal ratio, and mean and 95 % half width of the draws about it [% of it]."""
    for record in variant["records"]:
        low, high = np.percentile(record["drawn"], (2.5, 97.5))
        mean = float(np.mean(record["drawn"]))
        yield {
            "scene": variant["scene"], "form": variant["form"], "state": record["state"],
            "rpm": record["nominal_rpm"], "nominal": f"{record['nominal']:.6f}", "mean": f"{mean:.6f}",
            "U [%]": f"{50 * (high - low) / mean:.3f}",
            "finer [%]": f"{deviation_pct(record['finer'], record['nominal']):.4f}",
        }  # fmt: skip


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    found = [
        run_variant(
            one, records(), power=POWERS.get((one.scene, one.form), OTHER_POWER), jobs=options.jobs, progress=progress
        )
        for one in variants()
    ]  # fmt: skip
    text = "\n\n".join(text_rows(list(summary_rows(one))) for one in found)
    return StudyResult(name="cage_draws", content={"turns": TURNS, "variants": found}, text=text)
