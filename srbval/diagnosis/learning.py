"""The evidence that the posterior weighs features with, learnt from readings of known state.

Every class weighs as much as it is probable beforehand, every rig of a class the same, every bearing of a rig the same.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from srbval.arrays import FloatArray
from srbval.diagnosis.fault_posterior import CLASSES, PRIOR, Evidence

if TYPE_CHECKING:
    import pandas

START, PULL = (1.0, 4.0, -2.0, 2.0), 1e-3  # of the search, with shares as log odds; PULL keeps them off 0 and 1
HEAD = "# Weights of features, learnt from the known records of reports/naming.json (study naming, --evidence FILE).\n"
NUMBERS = ("slope", "onset", "hidden", "roller_hidden")


def weights(known: "pandas.DataFrame") -> FloatArray:
    """Weights of the readings `known` (columns rig, specimen, state), [n]."""
    rigs = known.groupby("state")["rig"].transform("nunique")
    bearings = known.groupby(["state", "rig"])["specimen"].transform("nunique")
    readings = known.groupby(["state", "rig", "specimen"])["rig"].transform("size")
    return np.asarray(known["state"].map(PRIOR) / rigs / bearings / readings)


def fit_evidence(known: "pandas.DataFrame") -> Evidence:
    """Evidence of the greatest mean log score on `known` (columns rig, specimen, state, features).

    `PULL` moves the shares of hidden faults towards a half.
    """
    from scipy.optimize import minimize

    bearings = known[["state", "rig", "specimen"]].drop_duplicates()["state"].value_counts()
    specimens, rigs = {name: int(bearings.get(name, 0)) for name in CLASSES}, int(known["rig"].nunique())
    features, weight = np.array(known["features"].tolist()), weights(known)
    of, prior = [CLASSES.index(state) for state in known["state"]], np.log([PRIOR[name] for name in CLASSES])

    def evidence(values: Sequence[float]) -> Evidence:
        slope, onset, *odds = map(float, values)
        shares = dict(zip(NUMBERS[2:], (1 / (1 + math.exp(-one)) for one in odds), strict=True))
        return Evidence(slope=slope, onset=onset, **shares, specimens=specimens, rigs=rigs)

    def loss(values: Sequence[float]) -> float:
        log = prior + np.column_stack((np.zeros(len(known)), evidence(values).log_ratios(features)))
        score = log[np.arange(len(known)), of] - np.logaddexp.reduce(log, axis=1)
        return float(-(weight @ score) + PULL * (values[2] ** 2 + values[3] ** 2))

    return evidence(minimize(loss, START, method="Nelder-Mead").x)


def evidence_toml(evidence: Evidence) -> str:
    """Text of the file ``evidence.toml``."""
    numbers = "\n".join(f"{name} = {getattr(evidence, name):.3g}" for name in NUMBERS)
    specimens = ", ".join(f"{name} = {count}" for name, count in evidence.specimens.items())
    return f"{HEAD}{numbers}\nrigs = {evidence.rigs}\nspecimens = {{ {specimens} }}\n"
