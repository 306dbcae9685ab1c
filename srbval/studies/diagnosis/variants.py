"""Other spectra for naming a fault, on all registered records.

Each variant takes the place of the spectrum that combs are read from; everything that is learnt is learnt again, with
one rig left out in turn. Counted are the answers of `diagnose` and the calibration error of its probabilities. Tried
and not adopted: no prewhitening; the squared cyclic spectral coherence and its mean over bands, the improved envelope
spectrum.
"""

import dataclasses
import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from unittest import mock

import numpy as np
import scipy.fft
import scipy.signal
import scipy.stats
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS
from srbval.diagnosis import fault_scores
from srbval.diagnosis.diagnose import channels_of
from srbval.diagnosis.fault_posterior import KnownFeatures, decide, fit_posterior
from srbval.progress import Progress
from srbval.reading import speed_search
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.pipeline import tracked
from srbval.recordings import ShaftSpeed
from srbval.signal import Periodogram, prewhitened
from srbval.signal.comb_spectrum import CombSpectrum
from srbval.signal.periodogram import NOISE_BINS, PADDING
from srbval.studies.diagnosis.known_records import KnownRecord, readings, specimen
from srbval.studies.diagnosis.reliability import held_out, scores

# Blocks overlap by all but this part of their length; the window is as wide in frequency as this part of the limit.
HOP, WIDTH = 8, 4
# Carrier frequencies left out at either end, as shares of the sampling rate.
ENDS = 0.01, 0.015
# Shares of the carriers: the whole band, its halves, its quarters.
BANDS = [(n / parts, (n + 1) / parts) for parts in (1, 2, 4) for n in range(parts)]
# How much further than needed coherences are computed, for the same record read at a higher speed.
REACH = 1.2
Spectrum = Callable[[Analysis], Periodogram]


@dataclass(frozen=True, kw_only=True, eq=False)
class CyclicCoherence:
    """`squared` [carriers, n]: |coherence|^2 of components a cyclic frequency apart, n multiples of `step_hz`."""

    squared: FloatArray
    step_hz: float

    def improved_envelope_spectrum(self, low: float = 0.0, high: float = 1.0) -> FloatArray:
        """Mean over the carriers from share `low` to share `high` of all, [n]."""
        edges = [round(share * len(self.squared)) for share in (low, high)]
        return np.asarray(self.squared[edges[0] : max(edges[0] + 1, edges[1])].mean(axis=0))


def cyclic_coherence(samples: FloatArray, fs_hz: float, limit_hz: float) -> CyclicCoherence:
    """Coherence of `samples` [m] for cyclic frequencies up to `limit_hz`, on a grid `PADDING` finer than 1 / duration.

    The fast estimator of Antoni, Xin & Hamzaoui (2017, Mech. Syst. Signal Process. 92, 248; idea quoted from memory,
    not checked): the short-time transform X(t, f), whitened by its own mean power, and for each cyclic frequency the
    transform over time of X(t, f) X*(t, f - p df) with the shift p that comes nearest. The mean product is removed, so
    that at cyclic frequency zero there is nothing.
    """
    block = 2 ** int(np.clip(round(math.log2(fs_hz * WIDTH / limit_hz)), 4, 10))
    hop = max(1, block // HOP)
    count = scipy.fft.prev_fast_len((samples.size - block) // hop + 1)
    blocks = np.lib.stride_tricks.sliding_window_view(samples, block)[::hop][:count]
    short = scipy.fft.rfft(blocks * scipy.signal.get_window("hann", block), axis=1)
    # Phases as of one time origin, not of each block's own.
    short = short * np.exp(-2j * math.pi * np.outer(np.arange(count) * hop / block, np.arange(short.shape[1])))
    short = (short / np.sqrt(np.mean(np.abs(short) ** 2, axis=0))).astype(np.complex64)
    rate, length = fs_hz / hop, count * PADDING
    step_hz, spacing_hz = rate / length, fs_hz / block
    cyclic_hz = np.arange(math.floor(limit_hz / step_hz) + 1) * step_hz
    shift = np.rint(cyclic_hz / spacing_hz).astype(np.int64)
    first, last = max(1, round(ENDS[0] * block)), short.shape[1] - 1 - round(ENDS[1] * block)
    squared = np.zeros((last - first, cyclic_hz.size), dtype=np.float32)
    for p in np.unique(shift):
        own = np.flatnonzero(shift == p)
        at = np.rint((cyclic_hz[own] - p * spacing_hz) / step_hz).astype(np.int64) % length
        for carrier in range(max(first, int(p)), last):
            product = short[:, carrier] * np.conj(short[:, carrier - p])
            lines = scipy.fft.fft(product - product.mean(), n=length)
            squared[carrier - first, own] = np.abs(lines[at] / count) ** 2
    return CyclicCoherence(squared=squared, step_hz=step_hz)


def exponential_ratio(spectrum: FloatArray, masked: NDArray[np.bool_]) -> FloatArray:
    """`spectrum` [n] over its local noise, as a variable that noise makes exponential of mean one, [n].

    The mean over K independent carriers follows a gamma distribution of shape K in noise; K is read from the spread of
    the bins outside `masked` [n], and each value becomes the exponential one of the same probability.
    """
    bins = np.arange(2, spectrum.size // PADDING) * PADDING
    bins = bins[~masked[bins]]
    median = median_filter(spectrum[bins].astype(np.float64), NOISE_BINS, mode="nearest")
    if bins.size == 0 or not np.all(median > 0):
        return np.zeros(spectrum.size)
    shapes = np.geomspace(0.5, 200, 200)
    quartiles = scipy.stats.gamma.ppf(np.array([[0.25], [0.5], [0.75]]), shapes)
    low, high = np.quantile(spectrum[bins] / median, (0.25, 0.75))
    shape = shapes[np.argmin(np.abs((quartiles[2] - quartiles[0]) / quartiles[1] - (high - low)))]
    value = spectrum / np.interp(np.arange(spectrum.size), bins, median) * scipy.stats.gamma.ppf(0.5, shape)
    surprise = -scipy.stats.gamma.logsf(value, shape)
    return np.where(np.isfinite(surprise), surprise, value)


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
    return speed_search.whitened_periodogram(analysis.processed, analysis.bearing, analysis.speed)


def not_prewhitened(analysis: Analysis) -> Periodogram:
    """The same without the prewhitening."""
    with mock.patch.object(speed_search, "prewhitened", lambda samples: samples - samples.mean()):
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


def scored(records: Sequence[tuple[KnownRecord, Analysis]], spectrum: Spectrum) -> dict[str, object]:
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


def variant_rows(known_: Sequence[KnownRecord], progress: Progress) -> list[dict[str, object]]:
    """Counts and calibration error with each of the spectra."""
    records = []
    for record in known_:
        recording, bearing = record.load()
        records.append((record, analyse(recording, bearing=bearing)))
    coherences, every, rows = Coherences(), len(BANDS), []
    variants: dict[str, Spectrum] = {
        "as shipped": shipped,
        "not prewhitened": not_prewhitened,
        "cyclic coherence": partial(coherences.spectrum, white=False, bands=1),
        "cyclic coherence, prewhitened": partial(coherences.spectrum, white=True, bands=1),
        f"cyclic coherence, best of {every} bands": partial(coherences.spectrum, white=False, bands=every),
        f"cyclic coherence, prewhitened, best of {every} bands": partial(coherences.spectrum, white=True, bands=every),
    }
    for number, (name, spectrum) in enumerate(variants.items()):
        progress(name, number / len(variants))
        rows.append({"spectrum": name} | scored(records, spectrum))
    progress("variants", 1.0)
    return rows
