"""Sweeps: simulate the scenes (inputs) of every table row, and add measures of the runs as further columns.

Each row is stored when its runs have ended, so that interrupted work continues.
"""

from __future__ import annotations

import inspect
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from srbval.models.run import BY_CHANCE
from srbval.models.simulate import Step, compile_for, run_content
from srbval.progress import Progress, silent
from srbval.scene import Scene
from srbval.storage.content_store import ContentStore
from srbval.sweep.pool import attempt, side_by_side

Case = Mapping[str, Any]  # a row of a table, by column
Measures = Mapping[str, Any]  # plain numbers, texts and lists of them, by column


def grid(**axes: Sequence[Any]) -> pd.DataFrame:
    """Table of all combinations of the axes' values, one row each; the last axis varies fastest."""
    return pd.DataFrame(list(itertools.product(*axes.values())), columns=list(axes))


def draws(ranges: Mapping[str, tuple[float, float]], n: int, *, seed: int) -> pd.DataFrame:
    """Table of `n` points of a Latin hypercube within `ranges` (low, high), one column per range."""
    from scipy.stats import qmc

    low, high = np.array(list(ranges.values()), dtype=float).T
    unit = qmc.LatinHypercube(d=len(ranges), rng=np.random.default_rng(seed)).random(n)
    return pd.DataFrame(low + unit * (high - low), columns=list(ranges))


def sweep(
    cases: pd.DataFrame,
    scenes_of: Callable[[Case], Scene | tuple[Scene, ...]],
    measure: Callable[..., Measures],
    *,
    task: str,
    step: Step = Step.UNCHECKED,
    jobs: int | None = None,
    progress: Progress = silent,
) -> pd.DataFrame:
    """Simulate and measure the scene or scenes of every row; returns `cases` with the measures as further columns.

    `scenes_of(case)` makes the scenes of a row. `measure(case, *attempts)` computes measures of their runs, failed runs
    included. A stored row is reused only if the source code behind `measure` is unchanged. The columns `status` and
    `reason` (of the first run of a row) are added unless `measure` returns them. `jobs` rows are computed at a time
    (default: one per core). `task` is the name shown with the progress.
    """
    rows = [dict(row) for row in cases.to_dict("records")]
    scenes = [one if isinstance(one, tuple) else (one,) for one in map(scenes_of, rows)]
    ours = measure.__module__.startswith("srbval.")
    store = ContentStore(kind="sweep", computed_by=measure.__module__ if ours else __name__)
    code = "" if ours else inspect.getsource(measure)
    contents = [" ".join(run_content(scene, step) for scene in of_row) for of_row in scenes]
    names = [f"{measure.__qualname__} {code} {row!r} {of}" for row, of in zip(rows, contents, strict=True)]
    found: dict[int, Measures | None] = {i: store.load(name, dict) for i, name in enumerate(names)}

    def run(place: int, report: Progress) -> Measures:
        def share_of(i: int) -> Progress:  # the scenes of a row share its progress
            return lambda task, share: report(task, (i + (share or 0.0)) / len(scenes[place]))

        tried = [attempt(scene, step=step, progress=share_of(i)) for i, scene in enumerate(scenes[place])]
        measures = {"status": tried[0].status, "reason": tried[0].reason, **measure(rows[place], *tried)}
        if not any(one.status in BY_CHANCE for one in tried):
            store.save(names[place], measures)
        return measures

    missing = {i: scenes[i][0] for i, one in found.items() if one is None}
    if missing:
        compile_for(*(scene for i in missing for scene in scenes[i]), jobs=jobs, progress=progress)
        found |= side_by_side(missing, run, task=task, jobs=jobs, progress=progress)
    measured = pd.DataFrame([found[i] or {} for i in range(len(rows))], index=cases.index)
    return pd.concat([cases, measured], axis=1)


def bisect(
    groups: pd.DataFrame,
    along: pd.Series,
    scenes_of: Callable[[Case], Scene | tuple[Scene, ...]],
    measure: Callable[..., Measures],
    passes: Callable[[Case], bool],
    *,
    step: Step = Step.UNCHECKED,
    jobs: int | None = None,
    progress: Progress = silent,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Find by bisection, for every row of `groups`, the last value of `along` at which `passes` accepts the run.

    The name of `along` is the column that varies; its values run from the safest to the most demanding. If a value
    passes, all safer values are assumed to pass. Returns two tables: `groups` with the value found (NaN if even the
    first fails), the number of `runs`, and ``bounded`` (True if a more demanding value failed); and all runs as rows.
    """
    axis, values = str(along.name), along.tolist()
    low, high = [-1] * len(groups), [len(values)] * len(groups)
    cells: list[pd.DataFrame] = []
    while open_ := [i for i in range(len(groups)) if high[i] - low[i] > 1]:
        middle = [(low[i] + high[i]) // 2 for i in open_]
        cases = groups.iloc[open_].assign(**{axis: [values[k] for k in middle]})
        task = f"bisect {axis}, round {len(cells) + 1}"
        done = sweep(cases, scenes_of, measure, task=task, step=step, jobs=jobs, progress=progress)
        cells.append(done)
        for i, k, cell in zip(open_, middle, done.to_dict("records"), strict=True):
            (low if passes(cell) else high)[i] = k
    run = pd.concat(cells) if cells else groups.assign(**{axis: math.nan}).iloc[:0]
    runs, last = [int((run.index == label).sum()) for label in groups.index], [*values, math.nan]  # `low` may be -1
    limits = groups.assign(**{axis: [last[k] for k in low], "runs": runs, "bounded": [k < len(values) for k in high]})
    return limits, run.reset_index(drop=True)


def records(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows of a data frame as dictionaries; missing values become None."""
    plain = frame.astype(object).where(frame.notna(), None)
    return [{str(name): value for name, value in row.items()} for row in plain.to_dict("records")]
