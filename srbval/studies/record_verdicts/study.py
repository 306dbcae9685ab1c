"""How often is the verdict by record wrong? Simulated rigs whose truth is known.

A rig is two records, outer and inner race. Its truth is what the model shows at inputs drawn from their ranges, plus
a known discrepancy, plus a mounting (size half-normal; levels normal with that size). "Full model": runs at draws that
no study has seen (`record_truths`), each used as often as the others. "Emulated": fresh draws by the sensitivity
study's emulators and a residual of theirs, so that the rule is tried on the distribution that it assumes. "Known
inputs": the emulators stand for a model whose inputs are known to `KNOWN` of their ranges, without choices, and the
mounting to `KNOWN_MOUNTING_DB`, as after several: what the rule says where U is narrow.

A truth is read as a record of 2, 10 or 30 s is: every harmonic is an amplitude plus complex normal noise, its power
over noise drawn for two seconds and growing with duration; the cage ratio gets normal errors of reading and of the
shaft's speed of the size the record states; the spectrum gets noise. What is not simulated: the record's samples, its
band and its search for lines.

Read values go through the program's own readings, comparison, verdict and Holm's procedure over the rig's two records.
Discrepancies: none (how often is a right model called resolved?), at the margin, in all or in one quantity (how often
is it said to agree?), drawn from the prior (do the intervals hold the error?).

Runs of the model, about seven seconds each, stand in a file to which more are added, one a line. Draw number i is the
same whenever it is made. Those with odd numbers may be used to mend the rule, error rates are counted on the even ones
alone.
"""

import json
import math
from argparse import ArgumentParser, Namespace
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import DEFAULT_BEARING, RACE_DEFECTS, Fault, load_bearing
from srbval.comparison.budget import PRIOR, VERDICT
from srbval.comparison.compared_quantities import CAGE_RATIO, COMPARED, SHAPE, compare, shape_angle
from srbval.comparison.comparison import MOUNTING, Comparison, QuantityValue
from srbval.comparison.counterpart import STARTS, TURNS, converged
from srbval.comparison.effects import DefectEffects, Sensitivity, sensitivity_of
from srbval.comparison.record_verdict import holm, record_verdict
from srbval.comparison.spectrum_shape import angle_within, halves_of, noise_about, with_noise
from srbval.errors import DataError, SrbvalError
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.lines import Line
from srbval.scene import Scene
from srbval.signal import LEAST_SNR, NORMAL_95
from srbval.storage.cache import RESULTS, cache_folder
from srbval.storage.stored_result import newest_result
from srbval.studies.emulator import Emulator, fit_emulator
from srbval.studies.harness import Study, StudyResult, input_hashes
from srbval.studies.input_effects import coordinates, groups_of, paper_scenes, predict, run_unchecked, values_of
from srbval.studies.open_inputs import drawn, open_inputs

RIGS, SEED = 500, 20
KNOWN, KNOWN_MOUNTING_DB = 0.1, 0.3
SECONDS = (2.0, 10.0, 30.0)
SNR = (30.0, 3000.0)  # of the first harmonic in 2 s, power over noise; even in the logarithm
SHAFT_HZ = 14.3
# Standard deviations, in shares of the line: of reading two seconds (the rig's outer-race record), of a speed's scale.
READING, SPEED = 1.7e-4, 1.0e-4
NONE, MARGIN, ONE, DRAWN = "none", "at the margin", "one at the margin", "from the prior"
DISCREPANCIES = (NONE, MARGIN, ONE, DRAWN)
MARGINS = {row.kind: row.margin for row in COMPARED if row.margin}
BEARING = load_bearing(DEFAULT_BEARING)


class Truth(NamedTuple):
    """Quantities of the model by fault, at one draw of the inputs, and its spectra, [2, bins]."""

    values: Mapping[Fault, Mapping[str, float]]
    halves: Mapping[Fault, FloatArray]


@dataclass(frozen=True, kw_only=True, eq=False)
class Setting:
    """Truths, each of a rig, the study that they are judged by, and the scale of the mounting's prior."""

    name: str
    truths: Sequence[Truth]
    study: Sensitivity
    discrepancies: tuple[str, ...] = (NONE, MARGIN, DRAWN)
    mounting_db: float = PRIOR.mounting_db


def make_truths(file: Path, count: int, progress: Progress) -> None:
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
        "values": {fault.value: dict(values_of(run)) for fault, run in runs.items()},
        "halves": {fault: None if own is None else own.round(3).tolist() for fault, own in halves.items()},
    }


def read_truths(file: Path) -> list[Truth]:
    """Those of a file with even numbers; draws that failed are left out."""
    rows = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
    return [
        Truth(
            {fault: row["values"][fault.value] for fault in RACE_DEFECTS},
            {f: np.array(own) for f in RACE_DEFECTS if (own := row["halves"][f.value]) is not None},
        )
        for row in rows
        if row["number"] % 2 == 0 and "values" in row
    ]


def emulators(study: DefectEffects) -> dict[str, Emulator]:
    """Fitted again to the runs of a study."""
    values, runs, found = np.array(study.values, dtype=float), np.array(study.at), {}
    groups = groups_of(open_inputs(), runs)
    for place, one in enumerate(study.quantities):
        shown = np.isfinite(values[:, place])
        found[one.name] = fit_emulator(runs[shown], values[shown, place], groups[shown])
    return found


def emulated(study: Sensitivity, count: int, seed: int = SEED) -> Setting:
    """Emulators at fresh draws of all inputs, the same draw for both faults, each with a residual."""
    inputs, rng = open_inputs(), np.random.default_rng(seed)
    at = coordinates(inputs, rng.random((count, len(inputs))))
    found = {}
    for fault in RACE_DEFECTS:
        own = effects_of(study, fault)
        fitted = emulators(own)
        found[fault] = dict(zip(fitted, predict(inputs, np.array(own.at), fitted, at)[1], strict=True))
    return Setting(name="emulated", truths=as_truths(found), study=study)


def known_inputs(study: Sensitivity, count: int, seed: int = SEED) -> Setting:
    """Emulators in place of the model over `KNOWN` of every range about its middle, the first of choices."""
    rng, found, effects = np.random.default_rng(seed), {}, []
    middle = np.array([0.0 if one.choices else 0.5 for one in open_inputs()])
    width = np.array([0.0 if one.choices else KNOWN for one in open_inputs()])
    for fault in RACE_DEFECTS:
        own = effects_of(study, fault)
        at, truths = (middle + width * (rng.random((n, middle.size)) - 0.5) for n in (len(own.predicted), count))
        fitted = emulators(own)
        predicted = np.array([one(at) for one in fitted.values()])
        found[fault] = {name: one(truths) for name, one in fitted.items()}
        scene = [float(one(middle[None])[0]) for one in fitted.values()]
        quantities = tuple(
            replace(one, value=value, shift=float(all_of_it.mean()) - value, deviation=float(all_of_it.std()))
            for one, value, all_of_it in zip(own.quantities, scene, predicted, strict=True)
        )
        effects.append(replace(own, quantities=quantities, predicted=predicted.T.tolist()))
    return Setting(
        name="known inputs", truths=as_truths(found), study=Sensitivity(defects=tuple(effects)),
        discrepancies=(NONE, MARGIN, ONE), mounting_db=KNOWN_MOUNTING_DB,
    )  # fmt: skip


def effects_of(study: Sensitivity, fault: Fault) -> DefectEffects:
    """Those of a race's defect."""
    own = study.of(fault)
    assert own is not None, "the study has both races"
    return own


def as_truths(values: Mapping[Fault, Mapping[str, FloatArray]]) -> list[Truth]:
    """One of each place in arrays by fault and quantity."""
    count = len(next(iter(values[Fault.OUTER].values())))
    return [Truth({f: {n: float(v[i]) for n, v in own.items()} for f, own in values.items()}, {}) for i in range(count)]


def model_values(sensitivity: Sensitivity, fault: Fault) -> dict[str, QuantityValue]:
    """The model's side as the study has it: the scene's own values, means over the starts."""
    return {
        one.name: QuantityValue(value=one.value, ci95=2.36 * one.start_sd / math.sqrt(STARTS))
        for one in effects_of(sensitivity, fault).quantities
    }


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
                depth=amplitude, detected=read_snr > LEAST_SNR, resolution_hz=1 / seconds,
            )
        )  # fmt: skip
    return SimpleNamespace(
        lines=lines, line_of=lambda _: lines[0], bearing=BEARING, recording=SimpleNamespace(file=f"{fault}", name=""),
        speed=SimpleNamespace(value_hz=SHAFT_HZ, ci95_hz=1.96 * SPEED * SHAFT_HZ),
        processed=SimpleNamespace(band_hz=(500.0, 1500.0), squared=np.ones(10), squared_fs_hz=2000.0),
    )  # fmt: skip


def shape_p(study: DefectEffects, truth: FloatArray | None, line: Line, rng: np.random.Generator) -> float | None:
    """The chance that the rule gives to the shape of a right model's spectrum, in the noise of a record's `line`."""
    noise = noise_about(line)
    if truth is None or noise is None or study.spectrum is None:
        return None
    halves = with_noise(truth, *noise, rng)
    within = angle_within(halves)
    rig = QuantityValue(value=within.degrees, ci95=within.ci95, line=line, halves=halves)
    made = shape_angle(SHAPE, QuantityValue(value=0.0, halves=np.array(study.spectrum)), rig, study)
    return None if made is None else made.get("p")


def discrepancies(
    kind: str, faults: Mapping[Fault, Iterable[str]], rng: np.random.Generator
) -> dict[Fault, dict[str, float]]:
    """Of every quantity of a rig, rig less model: in shares of the cage ratio, or dB; one cage, both records."""
    tau, cage_alone = abs(PRIOR.discrepancy_db * rng.standard_normal()), rng.random() < 0.5

    def one(margin: float, prior: float, chosen: bool) -> float:
        if kind == DRAWN:
            return prior * float(rng.standard_normal())
        return margin * float(rng.choice([-1, 1])) * (kind == MARGIN or (kind == ONE and chosen))

    cage = one(MARGINS[CAGE_RATIO.name] / 100, PRIOR.discrepancy_pct / 100, bool(cage_alone))
    found = {}
    for fault, names in faults.items():
        levels = [name for name in names if name != CAGE_RATIO.name]
        chosen = None if cage_alone else levels[int(rng.integers(len(levels)))]
        found[fault] = {name: one(MARGINS["harmonic 2"], tau, name == chosen) for name in levels}
        found[fault][CAGE_RATIO.name] = cage
    return found


Read = tuple[tuple[Comparison, ...], dict[str, float], Line]


def rig(setting: Setting, truth: Truth, kind: str, seconds: float, rng: np.random.Generator) -> list[Read]:
    """Of both records of one rig: comparisons, the discrepancies that it was given, and the line."""
    mounting = abs(setting.mounting_db * rng.standard_normal())
    given, found = discrepancies(kind, truth.values, rng), []
    for fault in RACE_DEFECTS:
        values = {}
        for name, value in truth.values[fault].items():
            off = given[fault][name]
            of_cage = name == CAGE_RATIO.name
            values[name] = value * (1 + off) if of_cage else value + off + mounting * rng.standard_normal()
        own = record(fault, values, seconds, rng)
        rows = compare(fault, own, model_values(setting.study, fault), setting.study)
        known = {MOUNTING: NORMAL_95 * setting.mounting_db}
        rows = tuple(replace(r, parts={n: known.get(n, part) for n, part in r.parts.items()}) for r in rows)
        found.append((rows, given[fault], own.lines[0]))
    return found


def rates(setting: Setting, kind: str, seconds: float, rigs: int = RIGS) -> dict[str, Any]:
    """Shares of so many rigs, each truth as often as the others, and of the errors that their 95 % intervals hold.

    `resolved` counts rigs with any record resolved, `single` records whose own p is below 0.05, `beyond_prior` those
    that are beyond the prior's discrepancy; `agree` records said to agree, `cage_agrees` in the cage ratio alone;
    `shape` records whose spectrum's shape is resolved, of every truth that has one once, without a discrepancy.
    """
    rng, limit = np.random.default_rng([SEED, int(seconds), DISCREPANCIES.index(kind)]), VERDICT.false_resolved
    shares: dict[str, list[bool]] = defaultdict(list)
    held: dict[str, list[bool]] = defaultdict(list)
    for number in range(rigs):
        truth = setting.truths[number % len(setting.truths)]
        made = rig(setting, truth, kind, seconds, rng)
        verdicts = [record_verdict(rows, setting.study.of(f)) for f, (rows, *_) in zip(RACE_DEFECTS, made, strict=True)]
        known = holm([one for one in verdicts if one is not None])
        shares["resolved"].append(any(one.p_holm < limit for one in known))
        shares["single"] += [one.p < limit for one in known]
        shares["beyond_prior"] += [one.p_discrepancy < limit for one in known]
        shares["agree"] += [one.agrees for one in known]
        if kind == NONE and number < len(setting.truths):
            lines = zip(RACE_DEFECTS, (line for *_, line in made), strict=True)
            ps = [shape_p(effects_of(setting.study, f), truth.halves.get(f), line, rng) for f, line in lines]
            shares["shape"] += [p < limit for p in ps if p is not None]
        for rows, given, _ in made:
            for row in rows:
                if row.quantity not in given or row.uncertainty is None or not row.both_present:
                    continue
                of_cage = row.kind == CAGE_RATIO.name
                off = row.error + (100 if of_cage else 1) * given[row.quantity]
                held[row.kind].append(abs(off) <= row.uncertainty)
                if of_cage:
                    shares["cage_agrees"].append(row.within_margin)
    names = ("resolved", "single", "beyond_prior", "agree", "cage_agrees", "shape")
    return {
        "truth": setting.name, "truths": len(setting.truths), "seconds": seconds, "discrepancy": kind, "rigs": rigs,
        **{name: float(np.mean(shares[name])) if shares[name] else None for name in names},
        "coverage": {name: float(np.mean(own)) for name, own in held.items()},
    }  # fmt: skip


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--truths", metavar="FILE", help="runs made so far, and to be (default: the user's cache)")
    parser.add_argument(
        "--count", metavar="N", type="count", default=200, help="how many runs there are to be, half of them counted"
    )


def _run(options: Namespace, progress: Progress) -> StudyResult:
    stored = newest_result("sensitivity")
    if stored is None:
        raise DataError("no stored sensitivity study; srbval study run sensitivity makes one.")
    file = Path(options.truths) if options.truths else cache_folder(RESULTS) / "record_truths.jsonl"
    make_truths(file, options.count, progress)
    sensitivity = sensitivity_of(stored.content)
    full = Setting(name="full model", truths=read_truths(file), study=sensitivity)
    settings = (full, emulated(sensitivity, RIGS), known_inputs(sensitivity, RIGS))
    rows = [
        rates(setting, kind, seconds) for setting in settings for seconds in SECONDS for kind in setting.discrepancies
    ]  # fmt: skip
    text = text_rows([
        {k: v for k, v in row.items() if k != "coverage"} | {k: f"{v:.3f}" for k, v in row["coverage"].items()}
        for row in rows
    ])  # fmt: skip
    content = {"truths": len(full.truths), "study_made_utc": stored.made_utc, "rows": rows}
    return StudyResult(name="record_verdicts", content=content, text=text, inputs=input_hashes(stored, file))


STUDY = Study(question="How often is the verdict by record wrong?", minutes=30, run=_run, options=_options)
