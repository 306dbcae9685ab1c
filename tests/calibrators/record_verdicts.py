"""How often is the verdict by record wrong? ``python -m tests.calibrators.record_verdicts``, on simulated rigs.

A rig is two records, outer and inner race. Its truth is what the model shows at inputs drawn from their ranges, plus
a known discrepancy, plus a mounting (size half-normal, `MOUNTING_DB`; levels normal with that size). "Emulated": fresh
draws, by the sensitivity study's emulators and a residual of theirs, so that the rule is tried on the distribution that
it assumes. "Full model": `TRUTHS` draws run anew, so few that a rate of 5 % is known to 4 or 5 % only, but free of the
emulator. A truth is read as a record of 2, 10 or 30 s is: every harmonic is an amplitude plus complex normal noise, its
power over noise drawn for two seconds and growing with duration; the cage ratio gets normal errors of reading and of
the shaft's speed of the size the record states. What is not simulated: the record's samples, its band and its search
for lines.

Read values go through the program's own readings, comparison, verdict and Holm's procedure over the rig's two records,
against the stored sensitivity study. Discrepancies: none (how often is a right model called resolved?), at the margin
(how often is it said to agree?), drawn from the prior (do the intervals hold the error?). The result is stored.
"""

from __future__ import annotations

import argparse
import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import DEFAULT_BEARING, RACE_DEFECTS, Fault, load_bearing
from srbval.cli.measured import this_machine
from srbval.errors import SrbvalError
from srbval.progress import ProgressDisplay
from srbval.signal import LEAST_SNR
from srbval.storage.own_package import git_revision
from srbval.storage.stored_result import COMMAND, RECORD_VERDICTS, SENSITIVITY, newest_result, stamped, store_result
from srbval.storage.strict_json import json_object
from srbval.validation.compared_quantities import CAGE_RATIO, KINDS, compare
from srbval.validation.comparison import MOUNTING_DB, Comparison, QuantityValue
from srbval.validation.counterpart import STARTS, TURNS, converged
from srbval.validation.effects import Sensitivity, sensitivity_of
from srbval.validation.emulator import fit_emulator
from srbval.validation.lines import Line
from srbval.validation.open_inputs import drawn, open_inputs
from srbval.validation.record_verdict import DISCREPANCY_DB, DISCREPANCY_PCT, LEVEL, holm, judge
from srbval.validation.sensitivity import _paper_scenes, _run, _values
from tests.calibrators.rows import print_rows

RIGS, TRUTHS, SEED = 500, 24, 20
SECONDS = (2.0, 10.0, 30.0)
SNR = (30.0, 3000.0)  # of the first harmonic in 2 s, power over noise; even in the logarithm
SHAFT_HZ = 14.3
# Standard deviations, in shares of the line: of reading two seconds (the rig's outer-race record), of a speed's scale.
READING, SPEED = 1.7e-4, 1.0e-4
NONE, MARGIN, PRIOR = "none", "at the margin", "from the prior"
MARGINS = {kind.name: kind.margin for kind in KINDS if kind.margin}
BEARING = load_bearing(DEFAULT_BEARING)

Truth = Mapping[Fault, Mapping[str, float]]  # quantities of the model by fault, at one draw of the inputs


@dataclass(frozen=True, kw_only=True)
class Rates:
    """Of one truth, duration and discrepancy: shares of the rigs, and of the errors that their 95 % intervals hold.

    `resolved` counts rigs with any record resolved, `single` records whose own p is below 0.05, `beyond_prior` those
    that are beyond the prior's discrepancy; `agree` records said to agree, `cage_agrees` in the cage ratio alone.
    """

    truth: str
    seconds: float
    discrepancy: str
    rigs: int
    resolved: float
    single: float
    beyond_prior: float
    agree: float
    cage_agrees: float
    coverage: Mapping[str, float]


def truths(count: int, seed: int = SEED) -> list[Truth]:
    """Full-model runs at draws of all inputs, the same draw for both faults; draws that fail are left out."""
    inputs, rng, found = open_inputs(), np.random.default_rng(seed), list[Truth]()
    scenes = {scene.defect.kind: converged(scene) for scene in _paper_scenes(TURNS)}
    with ProgressDisplay() as progress:
        for number, shares in enumerate(rng.random((count, len(inputs))).tolist()):
            progress("Simulate truths", number / count)
            try:
                found.append({f: _values(_run(*drawn(inputs, scenes[f], shares))) for f in RACE_DEFECTS})
            except SrbvalError:
                continue
    return found


def emulated(sensitivity: Sensitivity, count: int, seed: int = SEED) -> list[Truth]:
    """By the study's emulators at fresh draws of all inputs, the same draw for both faults, each with a residual."""
    inputs, rng = open_inputs(), np.random.default_rng(seed)
    shares = rng.random((count, len(inputs)))
    at = np.array([[one.coordinate(share) for one, share in zip(inputs, row, strict=True)] for row in shares])
    columns = {fault: _emulated(sensitivity, fault, at, rng) for fault in RACE_DEFECTS}
    return [{f: {n: float(v[i]) for n, v in columns[f].items()} for f in RACE_DEFECTS} for i in range(count)]


def _emulated(
    sensitivity: Sensitivity, fault: Fault, at: FloatArray, rng: np.random.Generator
) -> dict[str, FloatArray]:
    study = sensitivity.of(fault)
    assert study is not None, "the study has both races"
    values, runs = np.array(study.values, dtype=float), np.array(study.at)
    residual = rng.integers(len(runs), size=len(at))  # of one run, for all quantities
    found = {}
    for place, one in enumerate(study.quantities):
        shown = np.isfinite(values[:, place])
        emulator = fit_emulator(runs[shown], values[shown, place])
        residuals = np.zeros(len(runs))
        residuals[shown] = emulator.residuals
        found[one.name] = emulator(at) + residuals[residual]
    return found


def model_values(sensitivity: Sensitivity, fault: Fault) -> dict[str, QuantityValue]:
    """The model's side as the study has it: the scene's own values, means over the starts."""
    own = sensitivity.of(fault)
    assert own is not None, "the study has both races"
    return {one.name: QuantityValue(value=one.value, ci95=2.36 * one.start_sd / math.sqrt(STARTS)) for one in
            own.quantities}  # fmt: skip


def record(fault: Fault, values: Mapping[str, float], seconds: float, rng: np.random.Generator) -> Any:
    """What an analysis of a record with these values shows: its lines, read in noise, and its speed."""
    longer, line, z = seconds / 2, fault.line or "", BEARING.rolling_elements
    share = values["cage ratio"] if fault is Fault.OUTER else 1 - values["cage ratio"]
    reading, hz = READING / math.sqrt(longer), z * share * SHAFT_HZ
    snr = SNR[0] * (SNR[1] / SNR[0]) ** rng.random() * longer
    hz *= 1 + reading * rng.standard_normal() + SPEED * rng.standard_normal()
    levels = {(line, 1): 0.0} | {(line, h): values[f"{h}x{line}"] for h in (2, 3, 4) if f"{h}x{line}" in values}
    if f"{line} sidebands" in values:
        levels |= {(f"{line}{sign}{fault.sidebands}", 1): values[f"{line} sidebands"] for sign in "-+"}
    lines = []
    for (name, harmonic), level in levels.items():
        noise = complex(*rng.standard_normal(2)) / math.sqrt(2 * snr)
        amplitude = abs(10 ** (level / 20) + noise)
        read_snr = snr * amplitude**2
        lines.append(
            Line(
                name=name, harmonic=harmonic, kinematic_hz=hz, found_hz=hz, ci95_hz=1.96 * reading * hz, snr=read_snr,
                depth=amplitude, detected=read_snr > LEAST_SNR,
            )
        )  # fmt: skip
    return SimpleNamespace(
        lines=lines, line_of=lambda _: lines[0], bearing=BEARING, recording=SimpleNamespace(file=f"{fault}", name=""),
        speed=SimpleNamespace(value_hz=SHAFT_HZ, ci95_hz=1.96 * SPEED * SHAFT_HZ),
        processed=SimpleNamespace(band_hz=(500.0, 1500.0), squared=np.ones(10), squared_fs_hz=2000.0),
    )  # fmt: skip


def discrepancy(kind: str, name: str, tau: float, rng: np.random.Generator) -> float:
    """Of one quantity, rig less model: in shares of the cage ratio, or dB."""
    cage = name == CAGE_RATIO.name
    if kind == NONE:
        return 0.0
    if kind == MARGIN:
        return float(rng.choice([-1, 1])) * (MARGINS[CAGE_RATIO.name] / 100 if cage else MARGINS["harmonic 2"])
    return float(rng.standard_normal()) * (DISCREPANCY_PCT / 100 if cage else tau)


def rig(
    kind: str, seconds: float, pool: Sequence[Truth], sensitivity: Sensitivity, rng: np.random.Generator
) -> list[tuple[tuple[Comparison, ...], dict[str, float]]]:
    """Comparisons of both records of one rig, and the discrepancies that it was given (rig less model)."""
    truth = pool[int(rng.integers(len(pool)))]
    tau, mounting = abs(DISCREPANCY_DB * rng.standard_normal()), abs(MOUNTING_DB * rng.standard_normal())
    cage = discrepancy(kind, CAGE_RATIO.name, tau, rng)  # one cage, both records
    found = []
    for fault in RACE_DEFECTS:
        given = {n: cage if n == CAGE_RATIO.name else discrepancy(kind, n, tau, rng) for n in truth[fault]}
        values = {
            n: v * (1 + cage) if n == CAGE_RATIO.name else v + given[n] + mounting * rng.standard_normal()
            for n, v in truth[fault].items()
        }
        rows = compare(fault, record(fault, values, seconds, rng), model_values(sensitivity, fault), sensitivity)
        found.append((rows, given))
    return found


def rates(
    truth: str, kind: str, seconds: float, pool: Sequence[Truth], sensitivity: Sensitivity, rigs: int = RIGS
) -> Rates:
    """Of so many rigs."""
    rng = np.random.default_rng([SEED, int(seconds), (NONE, MARGIN, PRIOR).index(kind)])
    resolved, single, beyond, agree, cage_agrees = [], [], [], [], []
    held: dict[str, list[bool]] = defaultdict(list)
    for _ in range(rigs):
        made = rig(kind, seconds, pool, sensitivity, rng)
        judged = [judge(rows, sensitivity.of(f)) for f, (rows, _) in zip(RACE_DEFECTS, made, strict=True)]
        known = holm([one for one in judged if one is not None])
        resolved.append(any(one.p_holm < LEVEL for one in known))
        single += [one.p < LEVEL for one in known]
        beyond += [one.p_discrepancy < LEVEL for one in known]
        agree += [one.agrees for one in known]
        for rows, given in made:
            for row in rows:
                if row.quantity not in given or row.uncertainty is None or not row.both_present:
                    continue
                share = 100 if row.kind == CAGE_RATIO.name else 1
                held[row.kind].append(abs(row.error + share * given[row.quantity]) <= row.uncertainty)
                if row.kind == CAGE_RATIO.name:
                    cage_agrees.append(row.within_margin)
    return Rates(
        truth=truth, seconds=seconds, discrepancy=kind, rigs=rigs, resolved=float(np.mean(resolved)),
        single=float(np.mean(single)), beyond_prior=float(np.mean(beyond)), agree=float(np.mean(agree)),
        cage_agrees=float(np.mean(cage_agrees)),
        coverage={name: float(np.mean(own)) for name, own in held.items()},
    )  # fmt: skip


def main() -> None:
    """Run, count, print and store."""
    parser = argparse.ArgumentParser(description="Error rates of the verdict by record on simulated rigs.")
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, help="default: the user's cache")
    options = parser.parse_args()
    revision, study = git_revision(), newest_result(SENSITIVITY)
    if study is None:
        raise SystemExit(f"no stored sensitivity study; {COMMAND[SENSITIVITY]} makes one.")
    sensitivity = sensitivity_of(study.content)
    pools = {"emulated": emulated(sensitivity, RIGS), "full model": truths(TRUTHS)}
    rows = [
        rates(truth, kind, seconds, pool, sensitivity)
        for truth, pool in pools.items() for seconds in SECONDS for kind in (NONE, MARGIN, PRIOR)
    ]  # fmt: skip
    print_rows([
        {k: v for k, v in vars(row).items() if k != "coverage"} | {k: f"{v:.3f}" for k, v in row.coverage.items()}
        for row in rows
    ])  # fmt: skip
    content: dict[str, Any] = {
        "machine": this_machine(), "truths": len(pools["full model"]), "study_made_utc": study.made_utc,
        "rows": [json_object(row) for row in rows],
    }  # fmt: skip
    made = stamped(RECORD_VERDICTS, content, command=COMMAND[RECORD_VERDICTS], revision=revision)
    print(store_result(made, options.output))


if __name__ == "__main__":
    main()
