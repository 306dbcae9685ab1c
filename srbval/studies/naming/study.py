"""How often faults are named correctly on machines nobody tuned to: records of known state, by several methods.

No method sees the state that a record's name or data set declares. "record alone": the joint test with the evidence
that ships, without what is of the same rig, called where it is probable enough (`diagnose`); "learnt from ...": the
same with the other source of evidence (`learnt`); "one machine": all records of a bearing together
(`of_one_machine`). "excess 8, margin 3": the fault of the greatest excess, its own rig's records having no part in it
either, since nothing is learnt. The others are how it is commonly done: the highest of the fault lines in an envelope
spectrum, above a threshold, in the data set's band, in the most impulsive one, in the best of eight, or in the whole
band after cepstrum prewhitening.
"""

import dataclasses
import itertools
from argparse import Namespace
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS, RACE_DEFECTS, Bearing, Fault
from srbval.diagnosis.diagnose import contradicts_speed, fault_of, views_of
from srbval.diagnosis.fault_posterior import Evidence, decide, of_one_machine
from srbval.errors import DataError, SrbvalError
from srbval.progress import Progress
from srbval.reading.analyse import analyse
from srbval.reading.pipeline import WHOLE_BAND, band_kurtogram, declared_band, one_signal
from srbval.recordings import Recording, ShaftSpeed
from srbval.recordings.registry import listing
from srbval.signal import amplitude_spectrum, drop_ends, end_s, normalise, prewhitened, squared_envelope_one_pass
from srbval.storage.json_files import to_json
from srbval.storage.stored_result import newest_result
from srbval.studies.harness import StudyResult, input_hashes, printed_columns
from srbval.studies.known_records import KnownFeatures, KnownRecord, features_of, known_records, readings, specimen
from srbval.studies.naming.learnt import MACHINES, RECORDS, compared, ships, together, variants, without_each
from srbval.studies.naming.reliability import fit_evidence, naming_scores

ALL, RACES = "all", "both races"
# A line counts from this many times the median amplitude of its neighbourhood.
THRESHOLD = 5.0
# Half widths of a line's window and of its neighbourhood, as shares of its frequency.
WINDOW, NEIGHBOURHOOD = 0.02, 0.2
BANDS = 8
LEAST_EXCESS, LEAST_MARGIN = 8.0, 3.0
Row = dict[str, Any]
Band = tuple[float, float]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Seen:
    """What a record shows, its state apart: `views` are the features of each channel and speed.

    `denied`: the parts whose lines contradict the speed; `called`: what the methods that learn nothing call, by their
    names.
    """

    record: KnownRecord
    views: FloatArray
    denied: tuple[Fault, ...]
    called: Mapping[str, Fault | None]
    known: tuple[KnownFeatures, ...]


def plain_methods(recording: Recording, bearing: Bearing) -> dict[str, Callable[[], Fault | None]]:
    """The ways of practice, by name."""
    speed, signal, fs_hz = recording.speed, normalise(one_signal(recording)), recording.fs_hz
    assert speed is not None, "every set states one"
    low, high = (share * fs_hz for share in WHOLE_BAND)
    edges = np.linspace(low, high, BANDS + 1).tolist()

    def highest(samples: FloatArray, *bands: Band) -> Fault | None:
        return strongest_line(samples, fs_hz, bearing, speed, bands)

    return {
        "fixed band": lambda: highest(signal, declared_band(recording, None).band_hz),
        "kurtogram": lambda: highest(signal, band_kurtogram(recording, bearing, speed).best_hz),
        "best of 8 bands": lambda: highest(signal, *itertools.pairwise(edges)),
        "prewhitening": lambda: highest(prewhitened(signal), (low, high)),
    }


def strongest_line(
    samples: FloatArray, fs_hz: float, bearing: Bearing, speed: ShaftSpeed, bands_hz: Sequence[Band]
) -> Fault | None:
    """The fault whose line stands highest over its neighbourhood's median; None where none reaches `THRESHOLD`.

    Amplitudes of the squared envelope of `samples` [n] in each of `bands_hz`; first harmonics, within `WINDOW` of
    kinematics at `speed`.
    """
    ratios: dict[Fault, float] = {}
    for band_hz in bands_hz:
        square, rate = squared_envelope_one_pass(samples, fs_hz, band_hz)
        spectrum = amplitude_spectrum(drop_ends(square, rate, end_s(band_hz)), rate)
        for fault in DEFECTS:
            off = np.abs(spectrum.frequency_hz / (fault.line_order(bearing.orders) * speed.value_hz) - 1)
            inside, about = off <= WINDOW, (off > WINDOW) & (off <= NEIGHBOURHOOD)
            if inside.any() and about.any():
                ratio = float(spectrum.amplitude[inside].max() / np.median(spectrum.amplitude[about]))
                ratios[fault] = max(ratio, ratios.get(fault, 0.0))
    best = max(ratios, key=lambda fault: ratios[fault], default=None)
    return best if best is not None and ratios[best] >= THRESHOLD else None


def by_excess(views: Sequence[Sequence[float]]) -> Fault | None:
    """The fault of the greatest excess in any of `views`, if it is great and far above the others' of that view."""
    best = max(views, key=max)
    *_, second, first = sorted(best)
    clear = first >= LEAST_EXCESS and first - max(0.0, second) >= LEAST_MARGIN
    return DEFECTS[list(best).index(first)] if clear else None


def see(record: KnownRecord) -> Seen:
    """All of a record but what depends on the evidence of other rigs; raises what loading and `analyse` raise.

    A method of practice that refuses a record names nothing.
    """
    recording, bearing = record.load()
    analysis = analyse(recording, bearing=bearing)
    scores = [one for _, one in views_of(analysis, all_channels=True)]
    called: dict[str, Fault | None] = {"excess 8, margin 3": by_excess([one.unmasked for one in scores])}
    for name, method in plain_methods(recording, bearing).items():
        try:
            called[name] = method()
        except SrbvalError:
            called[name] = None
    return Seen(
        record=record, views=np.array([one.features for one in scores]),
        denied=tuple(fault for fault in DEFECTS if contradicts_speed(analysis, fault)), called=called,
        known=tuple(features_of(record, *one) for one in readings(record.state, analysis)),
    )  # fmt: skip


def scored(seen: Sequence[Seen], by_source: Mapping[str, Mapping[str, Evidence]], ships: str) -> list[Row]:
    """What every method calls of each record, with the evidence for its rig from each source, of which one `ships`."""
    alone = {name: [by[one.record.rig].log_likelihood(*one.views) for one in seen] for name, by in by_source.items()}
    machines, found = defaultdict(list), list[Row]()
    for one, log_likelihood in zip(seen, alone[ships], strict=True):
        machines[one.record.rig, specimen(one.record), one.record.state].append(log_likelihood)
    for number, one in enumerate(seen):
        entry, rig = one.record.entry, one.record.rig
        parts = {name: _part(by[rig], alone[name][number], one.denied) for name, by in by_source.items()}
        together = machines[rig, specimen(one.record), one.record.state]
        called = {
            "record alone": parts.pop(ships),
            "one machine": _part(by_source[ships][rig], of_one_machine(together)),
        }
        called |= {f"learnt from {name}": part for name, part in parts.items()}
        found.append({
            "dataset": entry.dataset or "", "bearing": one.record.load()[1].name,
            "file": "/".join(Path(entry.file).parts[-2:]), "channel": entry.channel, "state": one.record.state,
            "records": len(together), "called": called | dict(one.called),
        })  # fmt: skip
    return found


def _part(evidence: Evidence, log_likelihood: Mapping[str, float], denied: Sequence[Fault] = ()) -> Fault | None:
    part = fault_of(decide(evidence.probabilities(log_likelihood)))
    return None if part in denied else part


def counted(rows: Sequence[Row]) -> Iterator[Row]:
    """Per method, of all records, of each data set, bearing and class: right, wrong, none of the faulty; healthy ones.

    Intervals are Wilson's, of records: those of one rig are alike, so that they are narrower than for as many rigs.
    """
    groups: dict[tuple[str, str], list[Row]] = defaultdict(list)
    for row in rows:
        state = Fault(row["state"])
        of = [(ALL, ALL), ("set", row["dataset"]), ("bearing", row["bearing"])]
        of += [("class", state.label)] if state in DEFECTS else []
        of += [("class", RACES)] if state in RACE_DEFECTS else []
        for key in of:
            groups[key].append(row)
    for name in rows[0]["called"]:
        for (by, group), own in groups.items():
            faulty = [row["called"][name] for row in own if row["state"] in DEFECTS]
            right = sum(row["called"][name] == row["state"] for row in own if row["state"] in DEFECTS)
            none, healthy = faulty.count(None), len(own) - len(faulty)
            called = sum(row["called"][name] is not None for row in own if row["state"] not in DEFECTS)
            wrong = len(faulty) - right - none
            yield {
                "name": name, "by": by, "of": group, "right": right, "wrong": wrong, "none": none,
                "faulty": len(faulty), "healthy_called": called, "healthy": healthy,
                "right_ci95": _wilson(right, len(faulty)), "wrong_ci95": _wilson(wrong, len(faulty)),
                "called_ci95": _wilson(called, healthy),
            }  # fmt: skip


def _wilson(count: int, of: int) -> tuple[float, float] | None:
    """95 % interval of a share, `count` of `of` (Wilson 1927, J. Am. Stat. Assoc. 22, 209); None of nothing."""
    return tuple(binomtest(count, of).proportion_ci(method="wilson")) if of else None


def _text(content: Row) -> str:
    parts = [printed_columns(__package__, "methods", content["methods"])]
    for scores in (content["naming"]["scores"], content["naming"]["wrongly_read"]):
        parts.append(", ".join(f"{name.replace('_', ' ')} {value:.4g}" for name, value in scores.items()))
    parts.append(printed_columns(__package__, "classes", content["naming"]["by_class"]))
    parts.append(printed_columns(__package__, "learnt", content["learnt"]))
    return "\n\n".join([*parts, f"What ships is learnt from {content['ships']}."])


def evidence_text(evidence: Evidence) -> str:
    """The file ``srbval/diagnosis/evidence.toml``."""
    numbers = "\n".join(f"{name} = {getattr(evidence, name):.3g}" for name in NUMBERS)
    specimens = ", ".join(f"{name} = {count}" for name, count in evidence.specimens.items())
    return f"{HEAD}{numbers}\nrigs = {evidence.rigs}\nspecimens = {{ {specimens} }}\n"


NUMBERS = ("slope", "onset", "hidden", "roller_hidden")
HEAD = "# What the features of a record say; written by srbval study run naming --evidence FILE\n"
STORED = "simulated_machines"


def machines_of(rows: Sequence[Sequence[Any]]) -> list[list[KnownFeatures]]:
    """The machines of the result `STORED`, from the rows of their readings."""
    found = defaultdict(list)
    for number, rig, of, state, *features in rows:
        found[number].append(KnownFeatures(rig=rig, specimen=of, state=state, features=tuple(features)))
    return list(found.values())


def run(options: Namespace, progress: Progress) -> StudyResult:
    """`DataError` where no record of known state is registered, or no machines were simulated."""
    records = known_records(listing().recordings)
    if not records:
        raise DataError(
            "no measured recording of known state is registered; register some with srbval data add DIR, or name their "
            "folder in SRBVAL_RECORDINGS."
        )
    stored = newest_result(STORED)
    if stored is None:
        raise DataError("no simulated machines are stored to learn from; run `srbval study run simulated_machines`.")
    seen, machines = list[Seen](), machines_of(stored.content["features"])
    for number, record in enumerate(records):
        progress("read the records", number / len(records))
        seen.append(see(record))
    progress("read the records", 1.0)
    known, rigs = [one for record in seen for one in record.known], list(dict.fromkeys(one.record.rig for one in seen))
    sources = {RECORDS: known, MACHINES: together(machines)}
    by_source = {name: without_each(of, rigs) for name, of in sources.items()}
    learnt = compared(known, by_source | variants(machines, rigs))
    best = ships(learnt)
    if options.evidence:
        Path(options.evidence).write_text(evidence_text(fit_evidence(sources[best])), encoding="utf-8")
    rows, naming = scored(seen, by_source, best), naming_scores(known, by_source[best])
    content: Row = to_json({
        "methods": list(counted(rows)), "naming": naming, "learnt": learnt, "ships": best, "records": rows,
        "known": known,
    })  # fmt: skip
    inputs = input_hashes(stored, *(record.entry for record in records))
    return StudyResult(name="naming", content=content, text=_text(content), inputs=inputs)
