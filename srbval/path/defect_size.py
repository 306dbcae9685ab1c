"""The size of a defect along the rolling direction, from a record, with the path to the sensor known.

A roller enters the defect and leaves it a passage later: a force lost for so long has the spectrum of one pulse, whose
level rises with the size, and which dips where entry and exit cancel. The model runs at several sizes, and with inputs
drawn from their ranges, where along and around the race the defect lies among them. In each third octave of the path
the record's power that is locked to the fault is D [dB], with standard deviation u, and that of the run behind the path
P(e), interpolated over the logarithm of the size e and with the mean change by the drawn inputs. Where it shows

    D - P(e) ~ N(0, (1 + 1/K) C + u^2 + p^2 + tau^2 + l^2)

with the covariance C of what K draws change at their own size, the deviation p of the path's gains, and an error tau of
the model, in each band its own, of which only a prior is known, half-normal: it is integrated over. A band that does
not show is censored: what counts is the chance that it lies below its limit, those that show being given. All sizes
that are run are as likely beforehand, by their logarithm. l is how much is not known of all levels together: for the
shape alone it is without limit.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.special import log_ndtr

from srbval.arrays import FloatArray
from srbval.bearing import Bearing
from srbval.comparison.budget import PRIOR
from srbval.errors import ConfigurationError, DataError
from srbval.models.run import Run
from srbval.path.amplitudes import DB
from srbval.path.identify import behind, decibels, line_order, locked_db, record_powers, simulated_run
from srbval.progress import Progress, silent
from srbval.recordings import Recording
from srbval.scene import Scene, SensorPath

FACTORS = tuple(10 ** (n / 20) for n in range(-8, 9, 2))  # sizes that are simulated, over the scene's own
TRIED = 400  # sizes at which the likelihood is found
DRAWN_DECADES = 0.6  # over which runs with other inputs lie about the scene's own size: a factor of two either way
LONGEST_S = 1.0  # of a run: its lines repeat
LEAST_BANDS = 3
OPEN = math.exp(
    -1.92
)  # of the greatest likelihood: an end of the sizes run that fits so well is no end of the interval
LIMIT_U = 2.0  # deviations by which a band's power is above nothing where it shows
# One standard deviation of all levels together: without limit, that of another mounting, none.
LEVEL_U_DB = {"shape alone": 1e3, "level and shape, remounted": PRIOR.mounting_db, "level and shape": 0.0}


@dataclass(frozen=True, kw_only=True)
class SizeInterval:
    """The most likely size [m] and its 95 % interval; None where sizes beyond those simulated fit as well."""

    extent_m: float
    low_m: float | None
    high_m: float | None


@dataclass(frozen=True, kw_only=True)
class DefectSize:
    """A defect's extent along the rolling direction, by what it is taken from: the keys of `LEVEL_U_DB`.

    The first of them, the shape alone, is the one to quote: level and place of a defect cannot be told apart.
    `passage_s`: how long a contact takes from entry to exit of that size. `path_is_fitted`: the record gave the path,
    and with it gets the size back that was assumed then. `simulated_m`: the sizes run.
    """

    sizes: Mapping[str, SizeInterval]
    passage_s: float
    path_is_fitted: bool
    simulated_m: tuple[float, ...]


Runs = Sequence[tuple[float, Run]]  # each with the extent of its defect [m]


def size_runs(
    fault: Recording, scene: Scene, drawn: Sequence[Scene] = (), *, progress: Progress = silent
) -> tuple[Runs, Runs]:
    """Runs at the record's speed and load: of sizes about the scene's own, and of scenes with inputs `drawn`.

    All have one step more per output, which is short enough for the longest contacts that are drawn. Raises what
    `simulated_run` raises, and `ConfigurationError` for a scene whose defect has no extent.
    """
    own = scene.defect.extent_m
    if own is None:
        raise ConfigurationError("the scene's defect has no extent, about which sizes are tried; give it one.")
    shares = (np.arange(len(drawn)) + 0.5) / max(len(drawn), 1)
    wanted = [(own * factor, scene) for factor in FACTORS]
    wanted += [(own * 10 ** (DRAWN_DECADES * (share - 0.5)), one) for share, one in zip(shares, drawn, strict=True)]
    runs = []
    for number, (extent_m, one) in enumerate(wanted, start=1):
        solver = replace(one.solver, step_s=1 / ((one.steps_per_output + 1) * one.output_rate_hz))
        sized = replace(one, defect=replace(one.defect, extent_m=float(extent_m)), solver=solver)
        asked = fault
        if fault.radial_n is not None:  # off by as much as the drawn load is
            axial_n = (fault.axial_n or 0.0) + one.load.axial_n - scene.load.axial_n
            asked = replace(fault, radial_n=fault.radial_n * one.load.radial_n / scene.load.radial_n, axial_n=axial_n)
        runs.append((float(extent_m), simulated_run(asked, sized, longest_s=LONGEST_S)))
        progress("sizes", number / len(wanted))
    return runs[: len(FACTORS)], runs[len(FACTORS) :]


def defect_size(
    fault: Recording, runs: tuple[Runs, Runs], path: SensorPath, *, bearing: Bearing,
    healthy: Recording | None = None, band_hz: tuple[float, float] | None = None,
) -> DefectSize:  # fmt: skip
    """The size for which the `size_runs` behind the path make the fault's record, less what a `healthy` one has.

    Raises what `record_powers` raises, `ConfigurationError` for a band beyond the path's or a bearing without
    dimensions, and `DataError` where fewer than `LEAST_BANDS` third octaves can be read.
    """
    low_hz, high_hz = band_hz or (path.frequency_hz[0], path.frequency_hz[-1])
    if not path.low_hz <= low_hz < high_hz <= path.high_hz:
        raise ConfigurationError(
            f"band {low_hz:g} to {high_hz:g} Hz: the path holds from {path.low_hz:.0f} to {path.high_hz:.0f} Hz; "
            "give --band within."
        )
    if bearing.pitch_diameter_m is None or fault.speed is None:
        raise ConfigurationError(f"{fault.name}: a size needs the speed, and a bearing whose dimensions are known.")
    bands, powers = record_powers(fault, bearing, (low_hz, high_hz), healthy)
    middles = list(powers)
    shown = np.array([one.value > LIMIT_U * one.u for one in powers.values()])
    level = np.array([decibels(one.value if seen else max(one.value, 0.0) + LIMIT_U * one.u)
                      for seen, one in zip(shown, powers.values(), strict=True)])  # fmt: skip
    u_db = np.array([DB * one.u / one.value if seen else 0.0 for seen, one in zip(shown, powers.values(), strict=True)])
    if len(middles) < LEAST_BANDS:
        raise DataError(
            f"{fault.name}: {len(middles)} third octaves between {low_hz:.0f} and {high_hz:.0f} Hz are wide enough for "
            f"the fault's line; a size needs {LEAST_BANDS}. Widen --band, or use a record at a lower speed."
        )
    nominal, drawn = ([(e, locked_db(behind(run, path), bearing, bands, line_order(run, bearing))) for e, run in some]
                      for some in runs)  # fmt: skip
    logs = np.log([extent for extent, _ in nominal])
    between = PchipInterpolator(logs, [levels for _, levels in nominal], extrapolate=True)
    off = np.array([levels - between(math.log(extent)) for extent, levels in drawn]).reshape(len(drawn), len(middles))
    covariance = np.diag(u_db**2) + _path_covariance(path, np.array(middles))
    if len(drawn) > 1:
        covariance += (1 + 1 / len(drawn)) * np.atleast_2d(np.cov(off.T))
    tried = np.linspace(logs[0], logs[-1], TRIED)
    errors = level - between(tried) - (off.mean(axis=0) if drawn else 0.0)
    sizes = {name: _interval(tried, errors, shown, covariance + l_db**2) for name, l_db in LEVEL_U_DB.items()}
    ftf = bearing.orders.ftf
    speed_m_s = 2 * math.pi * fault.speed.value_hz * bearing.pitch_diameter_m * ftf * (1 - ftf)
    return DefectSize(
        sizes=sizes, passage_s=next(iter(sizes.values())).extent_m / speed_m_s,
        path_is_fitted=fault.name in path.used, simulated_m=tuple(extent for extent, _ in nominal),
    )  # fmt: skip


def _path_covariance(path: SensorPath, middles_hz: FloatArray) -> FloatArray:
    """Of the gains in these bands [dB^2], [n, n]; bands that were joined have one gain and share its error."""
    u_db = np.interp(np.log(middles_hz), np.log(path.frequency_hz), path.u_db or (0.0,) * len(path.load))
    gain = np.cumsum(np.diff(path.load, prepend=path.load[0]) != 0)  # its number, of each band of the path
    read = np.rint(np.interp(middles_hz, path.frequency_hz, gain))
    return np.asarray(np.outer(u_db, u_db) * (read[:, None] == read))


def _interval(
    tried: FloatArray, errors: FloatArray, shown: NDArray[np.bool_], covariance: FloatArray
) -> SizeInterval:  # fmt: skip
    """The most likely of sizes with these logarithms [m], [k], and the likeliest 95 %.

    `errors` are those of the bands that are `shown`, or of the limits of others, [k, n].
    """
    density = np.zeros(tried.size)
    seen, hidden = errors[:, shown], errors[:, ~shown]
    for scatter_db in np.linspace(0.0, 3 * PRIOR.discrepancy_db, 13)[1:]:
        whole = covariance + scatter_db**2 * np.eye(shown.size)
        known, both = whole[np.ix_(shown, shown)], whole[np.ix_(~shown, shown)]
        gain = np.linalg.solve(known, both.T).T
        misfit = np.sum(seen * np.linalg.solve(known, seen.T).T, axis=1) + np.linalg.slogdet(known)[1]
        spread = np.sqrt(np.diag(whole[np.ix_(~shown, ~shown)] - gain @ both.T))
        below = log_ndtr((hidden - seen @ gain.T) / spread).sum(axis=1)
        density += np.exp(below - 0.5 * (misfit + (scatter_db / PRIOR.discrepancy_db) ** 2))
    order = np.argsort(-density)
    inside = np.sort(order[: int(np.searchsorted(np.cumsum(density[order]), 0.95 * density.sum())) + 1])
    low, high = np.exp(tried[inside[[0, -1]]]).tolist()
    open_low, open_high = density[[0, -1]] > OPEN * density.max()
    return SizeInterval(
        extent_m=math.exp(tried[order[0]]), low_m=None if open_low or inside[0] == 0 else low,
        high_m=None if open_high or inside[-1] == tried.size - 1 else high,
    )  # fmt: skip
