"""Truths for `record_verdicts`: the full model at drawn inputs, one a line of a file to which more are added.

Made where the file ends; about seven seconds each. Draw number i is the same whenever it is made. Those with odd
numbers may be used to mend the rule, error rates are counted on the even ones alone.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import RACE_DEFECTS, Fault
from srbval.comparison.counterpart import TURNS, converged
from srbval.comparison.spectrum_shape import halves_of
from srbval.errors import SrbvalError
from srbval.progress import Progress, silent
from srbval.scene import Scene
from srbval.studies.input_effects import _values, paper_scenes, run_unchecked
from srbval.studies.open_inputs import drawn, open_inputs

SEED = 20


@dataclass(frozen=True, kw_only=True, eq=False)
class Truth:
    """Quantities of the model by fault, at one draw of the inputs, and its spectra, [2, bins]."""

    values: Mapping[Fault, Mapping[str, float]]
    halves: Mapping[Fault, FloatArray]


def make_truths(file: Path, count: int, progress: Progress = silent) -> None:
    """Add draws to `file` until it has `count`, those that failed with the reason."""
    scenes = {scene.defect.kind: converged(scene) for scene in paper_scenes(TURNS)}
    made = len(file.read_text(encoding="utf-8").splitlines()) if file.exists() else 0
    with file.open("a", encoding="utf-8") as out:
        for number in range(made, count):
            progress("Simulate truths", number / count)
            print(json.dumps(_truth(number, scenes)), file=out, flush=True)


def _truth(number: int, scenes: Mapping[Fault, Scene]) -> dict[str, Any]:
    inputs = open_inputs()
    at = np.random.default_rng([SEED, number]).random(len(inputs)).tolist()
    found: dict[str, Any] = {"number": number, "at": at}
    try:
        runs = {fault: run_unchecked(*drawn(inputs, scenes[fault], at)) for fault in RACE_DEFECTS}
    except SrbvalError as error:
        return found | {"failed": str(error)}
    halves = {fault.value: halves_of(run.analysis, fault) for fault, run in runs.items()}
    return found | {
        "values": {fault.value: dict(_values(run)) for fault, run in runs.items()},
        "halves": {fault: None if own is None else own.round(3).tolist() for fault, own in halves.items()},
    }


def read_truths(file: Path, *, odd: bool = False) -> list[Truth]:
    """Those of a file with even, or odd, numbers; draws that failed are left out."""
    rows = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
    return [
        Truth(
            values={fault: row["values"][fault.value] for fault in RACE_DEFECTS},
            halves={f: np.array(own) for f in RACE_DEFECTS if (own := row["halves"][f.value]) is not None},
        )
        for row in rows
        if row["number"] % 2 == odd and "values" in row
    ]
