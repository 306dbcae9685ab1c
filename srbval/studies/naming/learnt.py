"""What faults are best learnt from: records of known state, or simulated machines.

Both teach the same four numbers (`fit_evidence`) and are tested on the same real records, the rig of a record having no
part in what it is judged by: neither its records nor its healthy backgrounds. Said before the first test: simulated
machines, which need no record of a faulty bearing, are what ships, unless the records' gain in mean log score over them
lies above zero with its whole 95 % interval, rigs drawn with replacement.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from srbval.diagnosis.fault_posterior import Evidence
from srbval.studies.known_records import KnownFeatures
from srbval.studies.naming.reliability import HeldOut, called, fit_evidence, held_out, log_scores, scores

RECORDS, MACHINES = "records of known state", "simulated machines"
CURVE = (100, 300, 1000)  # machines, and all there are
DRAWS = 10_000
Machine = Sequence[KnownFeatures]  # what it is, and what it is not


def without_each(known: Sequence[KnownFeatures], rigs: Sequence[str]) -> dict[str, Evidence]:
    """For each rig the evidence of all that is `known` but for what is of that rig."""
    return {rig: fit_evidence([one for one in known if one.rig != rig]) for rig in rigs}


def together(machines: Sequence[Machine]) -> list[KnownFeatures]:
    """All readings of all machines."""
    return [one for machine in machines for one in machine]


def variants(machines: Sequence[Machine], rigs: Sequence[str]) -> dict[str, dict[str, Evidence]]:
    """By what else each rig could be judged: fewer machines, others, those of one other rig, and labels at random."""
    every = together(machines)
    parts = {f"{count} machines": machines[:count] for count in CURVE}
    parts[f"the last {CURVE[-1]} machines"] = machines[-CURVE[-1] :]
    found = {name: without_each(together(part), rigs) for name, part in parts.items()}
    backgrounds = sorted({one.rig for one in every})
    following = {rig: next((one for one in backgrounds if one > rig), backgrounds[0]) for rig in rigs}
    found["machines in backgrounds of one other rig"] = {
        rig: fit_evidence([one for one in every if one.rig == other]) for rig, other in following.items()
    }
    states = np.random.default_rng(0).permutation([one.state for one in every])
    permuted = [dataclasses.replace(one, state=str(state)) for one, state in zip(every, states, strict=True)]
    return found | {"machines, labels permuted": without_each(permuted, rigs)}


def compared(known: Sequence[KnownFeatures], by_source: Mapping[str, Mapping[str, Evidence]]) -> list[dict[str, Any]]:
    """Scores and calls of each source on the records `known`, and its gain over `RECORDS` with its 95 % interval."""
    found = {name: held_out(known, by) for name, by in by_source.items()}
    return [
        {"learnt_from": name} | scores(one) | called(one) | gain(one, found[RECORDS]) for name, one in found.items()
    ]


def gain(found: Sequence[HeldOut], over: Sequence[HeldOut]) -> dict[str, float]:
    """Gain in mean log score, with its 95 % interval over draws of as many rigs, with replacement."""
    rigs = sorted({f.record.rig for f in found})
    at = np.array([rigs.index(f.record.rig) for f in found])
    by_rig = np.bincount(at, log_scores(found) - log_scores(over), len(rigs))
    drawn = np.random.default_rng(0).integers(0, len(rigs), (DRAWS, len(rigs)))
    low, high = np.quantile(by_rig[drawn].sum(axis=1), (0.025, 0.975))
    return {"gain": float(by_rig.sum()), "gain_low": float(low), "gain_high": float(high)}


def ships(rows: Sequence[Mapping[str, Any]]) -> str:
    """The source that ships, by the rule at the head of this file."""
    machines = next(row for row in rows if row["learnt_from"] == MACHINES)
    return RECORDS if machines["gain_high"] < 0 else MACHINES
