"""Other spectra for naming a fault, on all registered records.

Each variant takes the place of the spectrum that combs are read from; everything that is learnt is learnt again, with
one rig left out in turn. Counted are the answers of `diagnose` and the calibration error of its probabilities.
"""

import dataclasses
from argparse import Namespace
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from unittest import mock

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS
from srbval.diagnosis import fault_scores
from srbval.diagnosis.diagnose import channels_of
from srbval.diagnosis.fault_posterior import KnownFeatures, decide, fit_posterior
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading import pipeline
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.pipeline import tracked
from srbval.recordings import ShaftSpeed
from srbval.recordings.registry import listing
from srbval.signal import Periodogram, prewhitened
from srbval.signal.comb_spectrum import CombSpectrum
from srbval.studies.harness import Study, StudyResult
from srbval.studies.known_state import KnownRecord, known_records, readings, specimen
from srbval.studies.naming_scores import held_out, scores
from srbval.studies.naming_variants.cyclic_coherence import cyclic_coherence, exponential_ratio

# Shares of the carriers: the whole band, its halves, its quarters.
BANDS = [(n / parts, (n + 1) / parts) for parts in (1, 2, 4) for n in range(parts)]
# How much further than needed coherences are computed, for the same record read at a higher speed.
REACH = 1.2
Spectrum = Callable[[Analysis], Periodogram]


@dataclass(frozen=True, kw_only=True, eq=False)
class BandSpectra(Periodogram):
    """A periodogram whose `power`, and that of further `bands`, is a ratio to noise; combs take their best band."""

    bands: tuple[FloatArray, ...] = ()


def best_of_bands(record: Periodogram, speed: ShaftSpeed) -> CombSpectrum:
    """In place of `fault_scores._combs`: each comb, and each placebo, in the band that shows it best."""
    lowest = fault_scores.LEAST_ORDER * speed.value_hz
    bands = record.bands if isinstance(record, BandSpectra) else (record.power,)
    found = [
        CombSpectrum.of(dataclasses.replace(record, power=power), lowest, fault_scores.HARMONICS) for power in bands
    ]
    score, mixed = (np.max([getattr(f, name) for f in found], axis=0) for name in ("score", "mixed"))
    return dataclasses.replace(found[0], score=score, mixed=mixed)


class Coherences:
    """Improved envelope spectra of every record and channel in `BANDS`, computed once."""

    def __init__(self) -> None:
        self._known: dict[tuple[int, bool], tuple[FloatArray, float, list[FloatArray]]] = {}

    def spectrum(self, analysis: Analysis, *, white: bool, bands: int) -> Periodogram:
        """The improved envelope spectrum in the first so many `BANDS`, with the masks of the usual periodogram."""
        done, plain = analysis.processed, shipped(analysis)
        key = id(done.whole), white  # the samples are kept, so that their address stays theirs
        if key not in self._known or self._known[key][1] * self._known[key][2][0].size < plain.limit_hz:
            samples = prewhitened(done.whole) if white else done.whole - done.whole.mean()
            even = tracked(samples, done.fs_hz, 0.0, done.tracking)
            found = cyclic_coherence(even, done.fs_hz, REACH * plain.limit_hz)
            self._known[key] = done.whole, found.step_hz, [found.improved_envelope_spectrum(*band) for band in BANDS]
        _, step_hz, spectra = self._known[key]
        grid_hz: FloatArray = np.asarray(np.arange(spectra[0].size) * step_hz, dtype=np.float64)
        masked = plain.masked(grid_hz)
        own_hz = np.arange(plain.power.size) * plain.step_hz
        powers = tuple(np.interp(own_hz, grid_hz, exponential_ratio(s, masked)) for s in spectra[:bands])
        return BandSpectra(**vars(plain) | {"power": powers[0]}, bands=powers)


def shipped(analysis: Analysis) -> Periodogram:
    """As the program does: the squared envelope of the whole band after cepstrum prewhitening."""
    return pipeline.whitened_periodogram(analysis.processed, analysis.bearing, analysis.speed)


def not_prewhitened(analysis: Analysis) -> Periodogram:
    """The same without the prewhitening."""
    with mock.patch.object(pipeline, "prewhitened", lambda samples: samples - samples.mean()):
        return shipped(analysis)


def features_of(analysis: Analysis, spectrum: Spectrum) -> tuple[float, ...]:
    """The features of a reading, from another spectrum."""
    with (
        mock.patch.object(fault_scores, "whitened_periodogram", return_value=spectrum(analysis)),
        mock.patch.object(fault_scores, "_combs", best_of_bands),
    ):
        return fault_scores.fault_scores(analysis).features


def known(record: KnownRecord, read: Analysis, spectrum: Spectrum) -> Iterator[KnownFeatures]:
    """What the record teaches: as it is, and as what it is not."""
    for state, analysis in readings(record, read):
        *families, unexplained = features_of(analysis, spectrum)
        yield KnownFeatures(
            rig=record.rig, specimen=specimen(record), state=state, families=tuple(families), unexplained=unexplained
        )


def judged(records: Sequence[tuple[KnownRecord, Analysis]], spectrum: Spectrum) -> dict[str, object]:
    """Counts of the answers with one rig left out in turn, and the calibration error."""
    taught = [features for record, read in records for features in known(record, read, spectrum)]
    models = {rig: fit_posterior([k for k in taught if k.rig != rig]) for rig in {k.rig for k in taught}}
    counts: Counter[str] = Counter()
    for record, read in records:
        views = channels_of(read).values()
        shares = models[record.rig].probabilities(*(np.array(features_of(view, spectrum)) for view in views))
        said = decide(shares)
        called = said in {fault.value for fault in DEFECTS}
        if record.state in DEFECTS:
            counts["right" if said == record.state else "wrong" if called else "none"] += 1
        else:
            counts["healthy called"] += called
    answers = {name: counts[name] for name in ("right", "wrong", "none", "healthy called")}
    return answers | {"calibration error": scores(held_out(taught))["calibration_error"]}


def _run(_: Namespace, progress: Progress) -> StudyResult:
    records = []
    for record in known_records(listing().recordings):
        recording, bearing = record.load()
        records.append((record, analyse(recording, bearing=bearing)))
    coherences = Coherences()

    def coherent(white: bool, bands: int) -> Spectrum:
        return lambda analysis: coherences.spectrum(analysis, white=white, bands=bands)

    variants: dict[str, Spectrum] = {
        "as shipped": shipped,
        "not prewhitened": not_prewhitened,
        "cyclic coherence": coherent(white=False, bands=1),
        "cyclic coherence, prewhitened": coherent(white=True, bands=1),
        "cyclic coherence, best of 7 bands": coherent(white=False, bands=len(BANDS)),
        "cyclic coherence, prewhitened, best of 7 bands": coherent(white=True, bands=len(BANDS)),
    }
    rows = []
    for number, (name, spectrum) in enumerate(variants.items()):
        progress(name, number / len(variants))
        rows.append({"spectrum": name} | judged(records, spectrum))
    progress("variants", 1.0)
    return StudyResult(name="naming_variants", content={"rows": rows}, text=text_rows(rows))


STUDY = Study(question="Would other spectra name faults better?", minutes=5, run=_run)
