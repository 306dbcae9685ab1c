"""Compiled kernels give what the same source gives uncompiled.

Reason: the compiler may reorder sums and contract products, and a stale or miscompiled kernel would go unnoticed. The
kernels run once more as plain Python in a process of its own. Source of the tolerance: reordering moves results by
rounding. Forces, powers and rates are each compared with the largest of their kind, a step of each family of methods
by the changes of the velocities.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from srbval.arrays import FloatArray
from srbval.models.full import columns as col
from tests.verification.cases import DEFECTS, disturbed, subject
from tests.verification.harness import PAPER_STEP_S, PRINTED_FIT, Parameters, layout_of, parameters, rates, stepped
from tests.verification.slices_reference import slices_model

SEEDS = (1, 2)
SLICED_SEEDS = (1,)  # uncompiled, slices take a second for each state
SLICED = {
    "slices, healthy": {"kind": "none"},
    "slices, hole": {"kind": "outer", "shape": "hole", "extent": "2 mm", "height": "-0.5 mm"},
    "slices, spall": {"kind": "inner", "extent": "6 mm", "width": "8 mm", "height": "-0.02 mm", "ramp": "1 mm"},
    "slices, roller": {"kind": "roller", "extent": "6 mm", "height": "-0.04 mm"},
}
OIL = {"traction": "lubricated"}
FITS = {"play": {}, "interference": PRINTED_FIT}
# Sums over all rollers are compared at 1e-12 of the largest. A single penetration of 3e-5 m is a difference of lengths
# of 0.16 m, so one rounding of 1e-16 in those is 1e-12 of it already, and a contact makes several: so well are loads,
# slides and spins known, and torque and powers, in which the friction of all contacts nearly cancels.
SUMS, SINGLE = 1e-12, 1e-11
STEP = 1e-10  # a step carries what slides and spins are off into its later stages' contacts
FAMILIES = ("ode4", "imex1", "imex2", "ros2")
SAME = dict.fromkeys(("force", "cage", "ring", "inertia"), SUMS) | {"step": STEP}
SAME |= dict.fromkeys(("slide", "spin", "loads", "torque", "powers"), SINGLE)

# Friction of a slice is an integral over its slips, over their range: a thousandth of them where a slice is narrow, as
# in a hole, and so rounding counts a thousand times and more.
ROUGHER = {"torque": 1e-10, "powers": 1e-9, "spin": 1e-8, "step": 1e-8}


def kinds(defect: str, fit: str, seed: int) -> dict[str, FloatArray]:
    """Everything the right-hand side gives for a state, by kind."""
    line_contact = OIL if defect in SLICED and fit == "play" else {}
    scene, model, _ = subject(
        {"contact": FITS[fit], "defect": (DEFECTS | SLICED)[defect], "line_contact": line_contact},
        make=slices_model if defect in SLICED else parameters,
    )
    y = disturbed(model, seed, cage_angle=scene.load.zone_rad)
    where, found = layout_of(y), rates(model, 0.0, y)
    return {
        "slide": found.rate[where.slide_rate],
        "spin": found.rate[where.spin],
        "cage": found.rate[where.cage_rate],
        "ring": found.rate[where.ring_rate],
        "force": found.totals[col.RING_FORCE],
        "torque": found.totals[[col.SHAFT_TORQUE]],
        "powers": found.totals[col.FRICTION_POWER : col.INERTIA_XX],
        "inertia": found.totals[col.INERTIA],
        "loads": found.load_n.ravel(),
        "step": np.concatenate([changes(model, y, method) for method in FAMILIES]),
    }


def seeds(defect: str) -> tuple[int, ...]:
    return SLICED_SEEDS if defect in SLICED else SEEDS


def changes(model: Parameters, y: FloatArray, method: str) -> FloatArray:
    """Change of each kind of velocity in a step, over the largest of its kind."""
    change = stepped(model, y, method, step_s=PAPER_STEP_S, first=0, steps=1)[0][0] - y
    return np.concatenate([change[part] / np.abs(change[part]).max() for part in layout_of(y).velocities])


def everything() -> dict[str, FloatArray]:
    return {
        f"{defect}/{fit}/{seed}/{kind}": values
        for defect in (*DEFECTS, *SLICED)
        for fit in FITS
        for seed in seeds(defect)
        for kind, values in kinds(defect, fit, seed).items()
    }


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """All results of uncompiled kernels."""
    path = tmp_path_factory.mktemp("plain") / "results.npz"
    code = (
        "import sys, numpy as np; from tests.verification.test_jit_equals_python import everything;"
        "np.savez(sys.argv[1], **everything())"
    )
    command = [sys.executable, "-c", code, str(path)]
    root = Path(__file__).parents[2]
    subprocess.run(command, cwd=root, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, check=True)
    with np.load(path) as results:
        return dict(results)


@pytest.mark.parametrize("defect", [*DEFECTS, *SLICED])
def test_compiled_equals_plain(defect, plain):
    for fit in FITS:
        for seed in seeds(defect):
            for kind, found in kinds(defect, fit, seed).items():
                expected = plain[f"{defect}/{fit}/{seed}/{kind}"]
                limit = (SAME | ROUGHER if defect in SLICED else SAME)[kind]
                assert found == pytest.approx(expected, abs=limit * float(np.abs(expected).max())), (fit, seed, kind)
