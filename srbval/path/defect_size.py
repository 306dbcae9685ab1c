"""The size of a defect along the rolling direction, from a record, with the path to the sensor known.

The model runs at several sizes; between them the logarithm of its power at each frequency is interpolated over that of
the size. Behind the path, this is compared with the record's powers in bands about the fault's harmonics, as `path_fit`
holds a path: D = H + |P|^2 X(size), with a scatter tau that is fitted too. For each size the likelihood is maximised
over all else, the path within its covariance (profile likelihood: Venzon & Moolgavkar 1988, Appl. Statist. 37, 87;
quoted from memory, not checked). What the model's inputs do is found by finding the sizes of runs with other inputs,
whose sizes are known: by their mean error the size is corrected, by their scatter the interval widened.

A roller enters the defect and leaves it a passage later: a force lost for so long has the spectrum of one pulse, whose
level rises with the size, and which dips where entry and exit cancel. For the shape alone the level is left free.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.optimize import least_squares
from scipy.special import stdtrit

from srbval.arrays import FloatArray
from srbval.bearing import Bearing
from srbval.comparison.budget import PRIOR
from srbval.errors import ConfigurationError
from srbval.path.identify import BAND_HZ, band_powers, simulated_excitation
from srbval.path.path_fit import DB, LEAST_DB, MOST_DB, BandPowers
from srbval.progress import Progress, silent
from srbval.recordings import Recording
from srbval.scene import Scene, SensorPath

FACTORS = tuple(10 ** (n / 20) for n in range(-8, 9))  # sizes that are simulated, over the scene's own
TRIED = 41  # sizes at which the likelihood is found
DRAWN_DECADES = 0.6  # over which runs with other inputs lie about the scene's own size: a factor of two either way
LONGEST_S = 1.0  # of a run: its lines repeat
# One standard deviation of all levels together: none, that of another mounting, and of a level left free.
LEVEL_U_DB = {"level and shape": 0.0, "level and shape, remounted": PRIOR.mounting_db, "shape alone": 100.0}


@dataclass(frozen=True, kw_only=True)
class SizeInterval:
    """The most likely size [m] and its 95 % interval; None where sizes beyond those simulated fit as well."""

    extent_m: float
    low_m: float | None
    high_m: float | None
    scatter_db: float


@dataclass(frozen=True, kw_only=True)
class DefectSize:
    """A defect's extent along the rolling direction, by what it is taken from: the keys of `LEVEL_U_DB`.

    `passage_s`: how long a contact takes from entry to exit of the size by level and shape. `path_is_fitted`: the
    record gave the path, and with it gets the size back that was assumed then. `simulated_m`: the sizes run.
    """

    sizes: Mapping[str, SizeInterval]
    passage_s: float
    path_is_fitted: bool
    simulated_m: tuple[float, ...]


Runs = Mapping[float, Recording]  # by the extent of their defect [m]


def size_runs(
    fault: Recording, scene: Scene, drawn: Sequence[Scene] = (), *, progress: Progress = silent
) -> tuple[Runs, Runs]:
    """Runs at the record's speed and load: of sizes about the scene's own, and of scenes with inputs `drawn`.

    All have one step more per output, which is short enough for the longest contacts that are drawn. Raises what
    `simulated_excitation` raises, and `ConfigurationError` for a scene whose defect has no extent.
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
        runs.append((float(extent_m), simulated_excitation(asked, sized, longest_s=LONGEST_S)))
        progress("sizes", number / len(wanted))
    return dict(runs[: len(FACTORS)]), dict(runs[len(FACTORS) :])


def defect_size(
    fault: Recording, healthy: Recording, runs: tuple[Runs, Runs], path: SensorPath, *, bearing: Bearing,
    band_hz: tuple[float, float] = BAND_HZ, ways: Mapping[str, float] = LEVEL_U_DB,
) -> DefectSize:  # fmt: skip
    """The size for which the `size_runs` behind the path make the fault's record, in these `ways`.

    Raises what `band_powers` raises, and `ConfigurationError` for a band beyond the path's or a bearing without
    dimensions.
    """
    if not path.low_hz <= band_hz[0] < band_hz[1] <= path.high_hz:
        raise ConfigurationError(
            f"band {band_hz[0]:g} to {band_hz[1]:g} Hz: the path holds from {path.low_hz:g} to {path.high_hz:g} Hz; "
            "give --band within."
        )
    if bearing.pitch_diameter_m is None or fault.speed is None:
        raise ConfigurationError(f"{fault.name}: a size needs the speed, and a bearing whose dimensions are known.")
    nominal, drawn = (
        {e: band_powers(fault, healthy, run, bearing=bearing, band_hz=band_hz) for e, run in sorted(some.items())}
        for some in runs
    )
    record, sizes, own = next(iter(nominal.values())), {}, np.append(path.parameters, 0.0)
    as_drawn = {extent: replace(one, fault=one.healthy + one.powers(own)) for extent, one in drawn.items()}
    for name, level_u_db in ways.items():
        known = [(extent, _interval(nominal, one, path, level_u_db)) for extent, one in as_drawn.items()]
        off = np.log([one.extent_m / extent for extent, one in known if one.low_m and one.high_m])
        sizes[name] = _widened(_interval(nominal, record, path, level_u_db), off, len(known))
    found = next(iter(sizes.values()))
    ftf = bearing.orders.ftf
    speed_m_s = 2 * math.pi * fault.speed.value_hz * bearing.pitch_diameter_m * ftf * (1 - ftf)
    return DefectSize(
        sizes=sizes, passage_s=found.extent_m / speed_m_s, path_is_fitted=fault.name in path.used,
        simulated_m=tuple(nominal),
    )  # fmt: skip


def _widened(found: SizeInterval, off: FloatArray, drawn: int) -> SizeInterval:
    """The interval of a size whose logarithm is found `off` by so much where it is known, as a next one will be.

    Of runs that were `drawn` those count whose size can be told; where fewer than two can, the interval has no ends.
    """
    if off.size < 2:
        return replace(found, low_m=None, high_m=None) if drawn else found
    more = float(stdtrit(off.size - 1, 0.975) * off.std(ddof=1) * math.sqrt(1 + 1 / off.size))
    extent_m = found.extent_m * math.exp(-float(off.mean()))

    def end(old_m: float | None, sign: int) -> float | None:
        return old_m and extent_m * math.exp(sign * math.hypot(math.log(old_m / found.extent_m), more))

    return replace(found, extent_m=extent_m, low_m=end(found.low_m, -1), high_m=end(found.high_m, 1))


def _interval(
    nominal: Mapping[float, BandPowers], record: BandPowers, path: SensorPath, level_u_db: float
) -> SizeInterval:
    """The profile of the likelihood over the size; its threshold allows for the scatter, which is estimated as well."""
    variance, axes = np.linalg.eigh(np.array(path.covariance) if path.covariance else np.zeros((0, 0)))
    root = axes * np.sqrt(np.maximum(variance, 0.0))
    logs = np.log(list(nominal))
    between = PchipInterpolator(logs, np.log([one.excitation for one in nominal.values()]))
    tried, dense = (np.linspace(logs[0], logs[-1], count) for count in (TRIED, 100 * TRIED))
    # numbers of variance one that move the path and the level, and ln scatter
    best, costs, scatters = np.append(np.zeros(variance.size + 1), math.log(max(path.scatter_db, 1.0))), [], []
    low = np.append(np.full(variance.size + 1, -np.inf), math.log(LEAST_DB))
    high = np.append(np.full(variance.size + 1, np.inf), math.log(MOST_DB))
    for one in tried:
        sized = np.exp(between(one))

        def errors(x: FloatArray, sized: FloatArray = sized) -> FloatArray:
            moved = replace(record, excitation=math.exp(level_u_db / DB * x[-2]) * sized)
            parameters = path.parameters + (root @ x[:-2] if root.size else 0.0)
            return np.concatenate((*moved.residuals(np.append(parameters, x[-1])), x[:-1]))

        solved = least_squares(errors, best, bounds=(low, high), ftol=1e-6, xtol=1e-4)
        best = solved.x
        costs.append(2 * float(solved.cost))
        scatters.append(math.exp(best[-1]))
    rise = CubicSpline(tried, costs)(dense)
    n, place = record.size, int(np.argmin(rise))
    spare = n - 2  # the size and the scatter
    inside = dense[rise - rise[place] <= n * math.log1p(float(stdtrit(spare, 0.975)) ** 2 / spare)]
    return SizeInterval(
        extent_m=math.exp(dense[place]), scatter_db=float(np.interp(dense[place], tried, scatters)),
        low_m=math.exp(inside[0]) if inside[0] > dense[0] else None,
        high_m=math.exp(inside[-1]) if inside[-1] < dense[-1] else None,
    )  # fmt: skip
