"""Frequency of a fault line by a joint fit of its harmonics and sidebands."""

import math
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.signal.false_alarm import false_alarm, neg_log_p, true_noise_ratio
from srbval.signal.joint_fit import fit
from srbval.signal.periodogram import Noise, Periodogram

# Harmonics fitted together, as far as they lie below the limit of the record.
HARMONICS = 5
# A line counts as detected when noise would show it less often than this, no more of the record's placebos than
# this are as strong ...
FALSE_ALARM, PLACEBO_FALSE_ALARM = 1e-3, 1e-2
# ... and its first harmonic is this many times the local noise in the squared envelope spectrum, which separates
# the records that Smith & Randall (2015, Mech. Syst. Signal Process. 64-65, 100) call diagnosable from the
# rest.
LEAST_SNR = 10.0
# A peak this much below a line within a few bins of it is a side lobe of that line (of a record without window:
# 1/(pi k)^2 at k bins).
SIDE_LOBE_BINS, SIDE_LOBE_SHARE = 4.0, 0.1
# Candidates per bin of the highest harmonic.
_OVERSAMPLING = 8


@dataclass(frozen=True, kw_only=True)
class LineReading:
    """One line (or comb of lines) as found.

    `found_hz` is the fundamental, `ci95_hz` the half width of its 95 % interval without the uncertainty of
    the shaft speed, `noise_ci95_hz` that from noise alone (Cramer-Rao); `snr` the power of each harmonic over the local
    mean noise power in a bin; `noise_false_alarm` the probability of at least this much from noise alone anywhere in
    the window, `placebo_false_alarm` the comb's rank among placebos (`rank_among_placebos`), None where it was not
    ranked; `isolated` is False where the peak is a side lobe of a far stronger line or of one outside the window.
    `depth` is the first harmonic's amplitude over the record's mean. `sideband_hz` and `sideband_ci95_hz` are the
    spacing of the sidebands fitted with the line and its 95 % half width, None where no sideband stood out.
    `resolution_hz` is one over the record's duration. Some peak is always *found*: whether it is a line is said by
    `detected`.
    """

    found_hz: float
    ci95_hz: float
    snr: tuple[float, ...]
    noise_false_alarm: float
    half_window_hz: float
    isolated: bool
    depth: float
    noise_ci95_hz: float
    resolution_hz: float
    sideband_hz: float | None = None
    sideband_ci95_hz: float | None = None
    placebo_false_alarm: float | None = None

    @property
    def detected(self) -> bool:
        """Whether it is a line: improbable as noise and as a placebo, strong, and no side lobe of another line."""
        improbable = is_improbable(self.noise_false_alarm, self.placebo_false_alarm)
        return self.isolated and improbable and self.snr[0] > LEAST_SNR


def is_improbable(noise_false_alarm: float, placebo_false_alarm: float | None) -> bool:
    """Whether neither noise nor the record's placebos, where it was ranked among them, explain a line."""
    return noise_false_alarm < FALSE_ALARM and (placebo_false_alarm or 0.0) < PLACEBO_FALSE_ALARM


def read_comb(
    record: Periodogram,
    expected_hz: float,
    half_window_hz: float,
    *,
    harmonics: int = HARMONICS,
    sideband_hz: float = 0.0,
    shortest_block_s: float | None = 0.0,
) -> LineReading | None:
    """Fit ``f, 2f, ... Hf``, and visible sidebands ``hf - s``, ``hf + s``, within `half_window_hz` of `expected_hz`.

    The fit starts at the highest `neg_log_p` of all harmonics together; from there the line and the spacing s, which
    starts at `sideband_hz` (zero: no sidebands), are fitted by maximum likelihood for lines of unknown amplitude and
    phase (Rife & Boorstyn 1974, IEEE Trans. Inf. Theory 20, 591), and the line's phase is tracked for slip
    (`track_slip`), unless `shortest_block_s` is None. Harmonics beyond ``record.limit_hz`` are left out; masked shaft
    harmonics do not count. The uncertainty combines noise and slip. None where even the fundamental lies beyond the
    limit, its whole window is masked, or no peak lies inside it.
    """
    used = min(harmonics, math.floor(record.limit_hz / (expected_hz + half_window_hz)))
    if used < 1:
        return None
    number = np.arange(1, used + 1)
    candidates = _candidates(record, expected_hz, half_window_hz, used)
    if np.all(record.masked(candidates)):
        return None
    noise = [record.noise_near(h * expected_hz, h * half_window_hz) for h in number]
    bins = np.array([n.bins for n in noise], dtype=np.float64)
    ratios = np.column_stack([_ratio(record, h * candidates, n) for h, n in zip(number, noise, strict=True)])
    best = _highest_peak(candidates, neg_log_p(ratios, bins).sum(axis=1))
    if best is None:
        return None
    # neg_log_p, which allows for noise that is only estimated, flattens the top of a strong line; its power does not.
    highest = _totals(_snr(record, best, noise), bins)
    near = np.abs(candidates - best) <= record.bin_hz
    best = float(candidates[near][np.argmax(ratios[near].sum(axis=1))])
    result = fit(record, best, noise, sideband_hz, shortest_block_s=shortest_block_s)
    snr = _snr(record, result.found_hz, noise)
    # The probability is that of the highest value in the window, which the fitted frequency may fall short of.
    visible = np.count_nonzero([~record.masked(h * candidates) for h in number], axis=0)
    share = np.bincount(visible, minlength=used + 1) / candidates.size
    probability = false_alarm(*max(_totals(snr, bins), highest), share, half_window_hz, record.seconds)
    around = (
        result.found_hz + np.linspace(-SIDE_LOBE_BINS, SIDE_LOBE_BINS, 8 * round(SIDE_LOBE_BINS) + 1) * record.bin_hz
    )
    is_highest = float(snr[0]) >= SIDE_LOBE_SHARE * float(np.max(_ratio(record, around, noise[0])))
    return LineReading(
        found_hz=result.found_hz,
        # No wider than to the window's far end; less would cut the interval of a line that is off its middle.
        ci95_hz=min(result.ci95_hz, half_window_hz + abs(result.found_hz - expected_hz)),
        snr=tuple(snr.tolist()),
        noise_false_alarm=probability,
        half_window_hz=half_window_hz,
        depth=record.depth_at(result.found_hz),
        isolated=abs(result.found_hz - expected_hz) < half_window_hz and is_highest,
        noise_ci95_hz=result.noise_ci95_hz,
        resolution_hz=record.bin_hz,
        sideband_hz=result.sideband_hz,
        sideband_ci95_hz=result.sideband_ci95_hz,
    )


def peak_snr(record: Periodogram, expected_hz: float, half_window_hz: float) -> float | None:
    """Power over noise of the highest peak within `half_window_hz`; None where `read_comb` would give None.

    Tells whether there is a line at all, without fitting its frequency.
    """
    candidates = _candidates(record, expected_hz, half_window_hz, 1)
    if expected_hz + half_window_hz > record.limit_hz or np.all(record.masked(candidates)):
        return None
    noise = record.noise_near(expected_hz, half_window_hz)
    best = _highest_peak(candidates, _ratio(record, candidates, noise))
    return None if best is None else float(_snr(record, best, [noise])[0])


def _totals(snr: FloatArray, bins: FloatArray) -> tuple[float, float]:
    """`neg_log_p` of all harmonics together, and the sum of their ratios to the true noise (`true_noise_ratio`)."""
    return float(neg_log_p(snr, bins).sum()), float(true_noise_ratio(snr, bins).sum())


def _highest_peak(candidates: FloatArray, score: FloatArray) -> float | None:
    """The candidate of the highest interior maximum; a maximum at the edge belongs to something outside."""
    peaks = np.flatnonzero((score[1:-1] >= score[:-2]) & (score[1:-1] > score[2:])) + 1
    return float(candidates[peaks[np.argmax(score[peaks])]]) if peaks.size else None


def _candidates(record: Periodogram, expected_hz: float, half_window_hz: float, used: int) -> FloatArray:
    step = record.bin_hz / (_OVERSAMPLING * used)
    count = max(1, math.ceil(half_window_hz / step))
    return expected_hz + np.linspace(-half_window_hz, half_window_hz, 2 * count + 1)


def _ratio(record: Periodogram, frequency_hz: FloatArray, noise: Noise) -> FloatArray:
    return np.where(record.masked(frequency_hz), 0.0, record.power_at(frequency_hz) / noise.mean_power)


def _snr(record: Periodogram, found_hz: float, noise: list[Noise]) -> FloatArray:
    """Power over noise of each harmonic of `found_hz`, from the Fourier sums themselves."""
    at = np.arange(1, len(noise) + 1, dtype=np.float64) * found_hz
    power = record.exact_power_at(at) / np.array([n.mean_power for n in noise])
    return np.where(record.masked(at), 0.0, power)
