"""Which band a record is demodulated in, who chose it, and the correction for a choice made on the record itself."""

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass

from srbval.bearing import Bearing, Fault
from srbval.errors import ConfigurationError
from srbval.reading.lines import Line
from srbval.reading.pipeline import SIMULATED_BAND_HZ, one_signal
from srbval.recordings import Origin, Recording, ShaftSpeed
from srbval.scene import BANDS_HZ
from srbval.scene.similar import size_of
from srbval.signal import Kurtogram, is_improbable, kurtogram, normalise

# Giraudo et al. 2025 (Sensors 25, 2419), sect. 5: band found best for the rig's signals.
RIG_BAND_HZ = BANDS_HZ["1400-2800"]
RIG_BEARING = "skf-22240"
# A band must hold this many harmonics of the higher race line in its envelope.
HARMONICS_HELD = 3
SAME_SIZE = 0.01  # a bearing larger by less than this keeps the paper's band
# The whole band, as shares of the sampling rate.
WHOLE_BAND = (0.01, 0.47)


@dataclass(frozen=True, kw_only=True)
class BandChoice:
    """The band [Hz], who chose it, and how many bands were tried on the record itself: 1 where none was.

    `chosen_by_line`: of how many of them the lines themselves decided, which is a trial of ranks among combs too.
    """

    band_hz: tuple[float, float]
    why: str
    trials: int = 1
    chosen_by_line: int = 1


def declared_band(
    recording: Recording, band_hz: tuple[float, float] | None, bearing: Bearing | None = None
) -> BandChoice:
    """The band given [Hz], or the data set's, or the paper's for the model or its rig.

    A model of a spherical roller bearing larger than the paper's rings as much lower (`srbval.scene.similar`), so the
    paper's band goes with the `bearing`; a smaller one's line shows in the paper's own. No rule guesses one for an
    unknown machine: a band chosen on the record it then judges finds lines in noise (`auto_band` chooses one and says
    what that costs). `ConfigurationError` asks for it instead.
    """
    if band_hz is not None:
        return BandChoice(band_hz=band_hz, why="given")
    if recording.band_hz is not None:
        return BandChoice(band_hz=recording.band_hz, why="declared by the data set")
    simulated = recording.origin is Origin.SIMULATED
    size = size_of(bearing) if simulated and bearing is not None and bearing.geometry is not None else None
    if size is not None and size > 1 + SAME_SIZE:
        low, high = (round(edge / size) for edge in SIMULATED_BAND_HZ)
        return BandChoice(band_hz=(low, high), why=f"the paper's, for a bearing {size:.3g} times as large")
    own = recording.dataset is None and recording.origin is Origin.MEASURED  # a like bearing in another machine
    if simulated or (recording.bearing == RIG_BEARING and not own):
        return BandChoice(band_hz=SIMULATED_BAND_HZ if simulated else RIG_BAND_HZ, why="the paper's")
    raise ConfigurationError(
        f"{recording.name}: neither the file nor its data set states a demodulation band; give --band LO HI "
        "[Hz], about a structural resonance that the fault would excite, or --auto-band."
    )


def bands_of_record(
    recording: Recording, bearing: Bearing, speed: ShaftSpeed, *, channel: str | None = None
) -> tuple[BandChoice, BandChoice]:
    """The whole band and the most impulsive one of the record itself, of which the lines decide (`clearness`).

    Impulses need not be the bearing's: one knock on the housing makes a band the most impulsive; and in the whole band
    loud machinery can hide a resonance. Every band tried counts as a trial. Raises what `kurtogram` raises.
    """
    picture = band_kurtogram(recording, bearing, speed, channel=channel)
    impulsive = f"the most impulsive of {picture.size} bands of this very record (kurtogram)"
    whole_hz = WHOLE_BAND[0] * recording.fs_hz, WHOLE_BAND[1] * recording.fs_hz
    said = "where a fault's line is clearer than in"
    return (
        _of_two(whole_hz, 2, f"the whole band, {said} {impulsive}"),
        _of_two(picture.best_hz, 2 * picture.size, f"{impulsive}, {said} the whole band"),
    )


def _of_two(band_hz: tuple[float, float], trials: int, why: str) -> BandChoice:
    why = f"{why}; false-alarm probabilities count {trials} trials"
    return BandChoice(band_hz=band_hz, why=why, trials=trials, chosen_by_line=2)


def clearness(lines: Iterable[Line]) -> tuple[float, float]:
    """How clearly a race or roller line shows, to choose among bands: -log of its false-alarm probability, then S/N."""
    firsts = (x for x in lines if x.harmonic == 1 and Fault.of_line(x.name) and x.explained_by is None)
    chance = ((x.noise_false_alarm, x.snr or 0.0) for x in firsts)
    return max(((-math.log(max(p, 1e-300)), snr) for p, snr in chance if p is not None), default=(0.0, 0.0))


def band_kurtogram(
    recording: Recording, bearing: Bearing, speed: ShaftSpeed, *, channel: str | None = None
) -> Kurtogram:
    """Kurtogram of the signal that is analysed, of bands wide enough for `HARMONICS_HELD` of the race lines."""
    widest = HARMONICS_HELD * max(bearing.orders.bpfo, bearing.orders.bpfi) * speed.value_hz
    return kurtogram(normalise(one_signal(recording, channel)), recording.fs_hz, least_width_hz=widest)


def sidak_corrected(lines: tuple[Line, ...], *, speeds: int = 1, band: BandChoice | None = None) -> tuple[Line, ...]:
    """The lines with their false-alarm probabilities corrected for the trials made, and detected by these.

    Sidak's correction 1 - (1 - p)^trials (Sidak 1967, J. Am. Stat. Assoc. 62, 626): exact for independent trials, too
    high for bands that overlap, as these do. A band that was chosen without regard to any comb is no trial of a rank
    among combs in that same band. A sideband counts only with its own line.
    """
    of_noise, of_rank = (1, 1) if band is None else (band.trials, band.chosen_by_line)
    if speeds * of_noise == 1:
        return lines
    corrected = [_corrected(line, speeds * of_noise, speeds * of_rank) for line in lines]
    own = {x.name for x in corrected if x.detected and x.harmonic == 1}
    # A sideband's name begins with its line's: ``BPFI-fr``.
    return tuple(
        dataclasses.replace(x, detected=x.detected and x.name.replace("+", "-").split("-")[0] in own) for x in corrected
    )


def _corrected(line: Line, of_noise: int, of_rank: int) -> Line:
    noise = _any_of(line.noise_false_alarm, of_noise)
    placebo = _any_of(line.placebo_false_alarm, of_rank)
    detected = line.detected and noise is not None and is_improbable(noise, placebo)
    return dataclasses.replace(line, noise_false_alarm=noise, placebo_false_alarm=placebo, detected=detected)


def _any_of(chance: float | None, trials: int) -> float | None:
    return chance if chance is None or chance >= 1 else -math.expm1(trials * math.log1p(-chance))
