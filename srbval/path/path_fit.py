"""Fitting a path to the sensor to powers in bands, or to a measured response; the number of modes by a criterion.

Powers: the fault's record has D = H + |P|^2 X in each band, H the healthy record's and X that of the simulated ring. Of
D's level in dB the error has variance

    v = 2 w s^2 + tau^2 (w^2 + (1 - w)^2),    w = H / (H + |P|^2 X),    s = (10 / ln 10) / sqrt(B T).

A background of B T degrees of freedom has the variance H^2 / (B T) in either record, and 2 H |P|^2 X / (B T) with the
fault's lines, which by themselves do not scatter: of D^2 that is 2 w in all. tau is fitted too: what the simulated
force misses, and how the background changes from one bearing mounted to the next. A mode narrower than half a band is
seen by one band at most, and is not looked for. A fit that ends there, and without the band that gains most by its last
mode would lose to the fit without that mode, has taken one loud band for a mode: it is not chosen.
The number of modes has the least -2 ln L + k max(ln n, 2 n / (n - k - 1)): the penalty of Schwarz (1978, Ann. Statist.
6, 461), which holds for many n, or where n is small the greater one of Hurvich & Tsai (1989, Biometrika 76, 297): with
23 bands the former alone gives a third of paths a mode too many. Covariance: the inverse of Fisher's information, times
n / (n - k), since the scatter is estimated as well.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.scene import PathMode, SensorPath
from srbval.scene.sensor_path import MOST_MODES, response

DB = 10 / math.log(10)
DAMPING = (0.003, 0.3)  # least and greatest damping ratio that is looked for
START_DAMPING = (0.04, 0.1)
STARTS, BEST = 12, 4  # frequencies tried for a new mode; how many of all trials are followed to the end
HIGHEST_GAIN, MOST_DB = 1e3, 30.0
LEAST_DB = 0.1  # what a path in time and powers on a grid are good to
LEAST_VARIANCE = 0.4 * LEAST_DB**2  # w^2 + (1 - w)^2 is a half or more
AT_LIMIT = 0.01  # relative: so near to the narrowest a mode has ended there
LEAST_SPARE = 4  # bands more than parameters


@dataclass(frozen=True, kw_only=True, eq=False)
class BandPowers:
    """Powers in bands: of the `excitation` on a grid of `frequency_hz` in each band, [n, m], of the fault's record and
    of its `healthy` one, [n], with `freedom` = B T.

    `coloured`: the excitation is unknown and taken as a power of the frequency, which is fitted.
    """

    band_hz: tuple[float, float]
    frequency_hz: FloatArray
    excitation: FloatArray
    fault: FloatArray
    healthy: FloatArray
    freedom: float
    coloured: bool = False

    @property
    def extras(self) -> tuple[tuple[float, float, float], ...]:
        """Start, least and greatest value of the scatter ln tau [dB], and of the exponent."""
        return ((math.log(2.0), math.log(LEAST_DB), math.log(MOST_DB)), *(((0.0, -8.0, 8.0),) if self.coloured else ()))

    @property
    def size(self) -> int:
        """Number of bands."""
        return self.fault.size

    @property
    def scale(self) -> float:
        """Root of the fault's increment over the excitation, in the median band."""
        increment = np.maximum(self.fault - self.healthy, 0.05 * self.fault)
        return float(np.median(np.sqrt(increment / self.excitation.sum(axis=1))))

    @property
    def spacing_hz(self) -> float:
        """Width of a band."""
        return float(self.frequency_hz[1].mean() - self.frequency_hz[0].mean())

    def powers(self, parameters: FloatArray) -> FloatArray:
        """What the path makes of the excitation, [n]."""
        count = parameters.size - len(self.extras)
        shape = (self.frequency_hz / self.band_hz[0]) ** parameters[-1] if self.coloured else 1.0
        gain = np.abs(response(self.frequency_hz, parameters[:count])) ** 2
        return np.asarray((gain * shape * self.excitation).sum(axis=1))

    def residuals(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Errors over their deviations, and what the deviations add: -2 ln L is the sum of squares of both."""
        scatter = math.exp(parameters[-1 - self.coloured])
        whole = self.powers(parameters) + self.healthy
        share = self.healthy / whole
        variance = 2 * share * (DB / math.sqrt(self.freedom)) ** 2 + (share**2 + (1 - share) ** 2) * scatter**2
        return DB * np.log(self.fault / whole) / np.sqrt(variance), np.sqrt(np.log(variance / LEAST_VARIANCE))

    def chance(self, path: SensorPath, scatter_db: float = 0.0) -> float:
        """Chance of levels so far off, were this path right and the force known to within `scatter_db`."""
        from scipy.special import gammaincc

        own = np.append(path.parameters, math.log(max(scatter_db, LEAST_DB)))
        errors, _ = self.residuals(np.append(own, 0.0) if self.coloured else own)
        return float(gammaincc(self.size / 2, float(errors @ errors) / 2))


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredResponse:
    """A measured response P, complex, [n]; errors are normal and alike, their size is fitted."""

    band_hz: tuple[float, float]
    frequency_hz: FloatArray
    values: NDArray[np.complex128]

    @property
    def extras(self) -> tuple[tuple[float, float, float], ...]:
        """Logarithm of the errors' deviation over `floor`."""
        return ((math.log(30.0), 0.0, math.log(1e6)),)

    @property
    def size(self) -> int:
        """Real and imaginary parts."""
        return 2 * self.values.size

    @property
    def scale(self) -> float:
        """Median size."""
        return float(np.median(np.abs(self.values)))

    @property
    def spacing_hz(self) -> float:
        """Median distance of two lines."""
        return float(np.median(np.diff(self.frequency_hz)))

    @property
    def floor(self) -> float:
        """The least deviation of an error."""
        return 1e-4 * float(np.sqrt(np.mean(np.abs(self.values) ** 2)))

    def residuals(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Real and imaginary parts."""
        error = response(self.frequency_hz, parameters[:-1]) - self.values
        deviation = self.floor * math.exp(parameters[-1])
        both = np.append(error.real, error.imag) / deviation
        return both, np.full(both.size, math.sqrt(2 * max(parameters[-1], 0.0)))


# What a path is fitted to: parameters are those of `SensorPath`, then `extras` of its own.
FittedTo = BandPowers | MeasuredResponse


@dataclass(frozen=True, kw_only=True, eq=False)
class PathFit:
    """The most likely path with a given number of `modes`, and how well it fits.

    `parameters` are those of `SensorPath`, then the data's own extras; `covariance` is that of all of them, [n, n].
    `criterion` is -2 ln L plus the penalty for their number, and `costs` the share of -2 ln L that each number of the
    data has. `one_band`: a mode ended as narrow as bands can show, and without the band that gains most by it the fit
    with one mode less would win.
    """

    modes: int
    parameters: FloatArray
    covariance: FloatArray
    criterion: float
    costs: FloatArray
    one_band: bool = False

    def path(self, data: FittedTo, *, source: str, used: tuple[str, ...] = ()) -> SensorPath:
        """The fitted path as a scene takes it; its scatter allows for the parameters that followed errors."""
        count = 1 + 3 * self.modes
        own = self.parameters[1:count].reshape(-1, 3).tolist()
        freed = math.sqrt(data.size / (data.size - self.parameters.size))  # errors that parameters follow
        return SensorPath(
            direct=math.exp(self.parameters[0]),
            modes=tuple(PathMode(frequency_hz=math.exp(f), damping_ratio=math.exp(z), gain=g) for f, z, g in own),
            low_hz=data.band_hz[0], high_hz=data.band_hz[1],
            scatter_db=math.exp(self.parameters[count]) * freed if isinstance(data, BandPowers) else 0.0,
            source=source, used=used,
            covariance=tuple(tuple(row) for row in self.covariance[:count, :count].tolist()),
        )  # fmt: skip


def fit_path(data: FittedTo, most_modes: int = MOST_MODES) -> tuple[PathFit, ...]:
    """Paths of 0, 1, ... modes, as many as there is data for; see `best_of`."""
    found: list[PathFit] = []
    for modes in range(most_modes + 1):
        starts = _starts(data, found[-1] if found else None)
        if data.size < 1 + 3 * modes + len(data.extras) + LEAST_SPARE:
            break
        costs = [sum(float(part @ part) for part in data.residuals(start)) for start in starts]
        tried = [_descend(data, starts[place]) for place in np.argsort(costs)[:BEST]]
        best = min(tried, key=lambda fit: fit.criterion)
        narrowest = max(DAMPING[0], (1 + AT_LIMIT) * _half_a_band(data))
        if np.any(np.exp(best.parameters[2 : 1 + 3 * modes : 3]) < narrowest):
            lone = best.criterion + (found[-1].costs - best.costs).max() > found[-1].criterion
            best = replace(best, one_band=bool(lone))
        found.append(best)
    return tuple(found)


def best_of(fits: tuple[PathFit, ...]) -> PathFit:
    """The one with the least criterion, but for those with a mode that is one loud band."""
    return min((fit for fit in fits if not fit.one_band), key=lambda fit: fit.criterion)


def refit(data: FittedTo, start: PathFit) -> PathFit:
    """The same number of modes fitted to other data, from where another fit ended."""
    count = 1 + 3 * start.modes
    values = start.parameters[:count].copy()
    change = math.log(data.scale) - values[0]
    values[0] += change
    values[3::3] *= math.exp(change)
    return _descend(data, np.append(values, [start for start, _, _ in data.extras]))


def inflated(fit: PathFit, other: PathFit) -> tuple[PathFit, list[float]]:
    """The fit with the deviations of its frequencies widened where another record's differ by more than 2 u.

    Then 2 u is made the difference. Also the differences in units of their own u, one a mode.
    """
    covariance, ratios = fit.covariance.copy(), []
    for place in range(1, 1 + 3 * fit.modes, 3):
        apart = abs(other.parameters[place] - fit.parameters[place])
        u = math.sqrt(fit.covariance[place, place] + other.covariance[place, place])
        ratios.append(apart / u)
        if apart > 2 * u:
            factor = max(1.0, apart / (2 * math.sqrt(covariance[place, place])))
            covariance[place, :] *= factor
            covariance[:, place] *= factor
    return replace(fit, covariance=covariance), ratios


def _starts(data: FittedTo, before: PathFit | None) -> list[FloatArray]:
    """The path before with a new mode at several places, of either sign; without one, the direct way alone."""
    extras = [one[0] for one in data.extras]
    if before is None:
        return [np.array([math.log(data.scale), *extras])]
    count = 1 + 3 * before.modes
    low, high = data.band_hz
    return [
        np.concatenate((
            before.parameters[:count],
            [math.log(own_hz), math.log(damping), sign * 2 * damping * math.exp(before.parameters[0])],
            before.parameters[count:],
        ))
        for own_hz in np.geomspace(1.05 * low, 0.95 * high, STARTS)
        for damping in START_DAMPING
        for sign in (1, -1)
    ]  # fmt: skip


def _bounds(data: FittedTo, size: int) -> Iterator[tuple[float, float]]:
    """Of each parameter; modes stay within the band or a quarter above it, where their flank still shows."""
    modes = (size - 1 - len(data.extras)) // 3
    scale = math.log(data.scale)
    yield scale - 12, scale + 12
    for _ in range(modes):
        yield math.log(data.band_hz[0]), math.log(1.25 * data.band_hz[1])
        yield math.log(max(DAMPING[0], _half_a_band(data))), math.log(DAMPING[1])
        yield -HIGHEST_GAIN * data.scale, HIGHEST_GAIN * data.scale
    for _, low, high in data.extras:
        yield low, high


def _half_a_band(data: FittedTo) -> float:
    """Damping ratio of a mode half a band wide in the middle of the whole band, by its half-power width."""
    return data.spacing_hz / (4 * math.sqrt(data.band_hz[0] * data.band_hz[1]))


def _descend(data: FittedTo, start: FloatArray) -> PathFit:
    from scipy.optimize import least_squares

    low, high = np.array(list(_bounds(data, start.size))).T
    begun = np.clip(start, low + 1e-6 * (high - low), high - 1e-6 * (high - low))
    solved = least_squares(
        lambda x: np.concatenate(data.residuals(x)), begun, bounds=(low, high), x_scale="jac", max_nfev=200
    )
    modes, n, k = (start.size - 1 - len(data.extras)) // 3, data.size, start.size
    count = 1 + 3 * modes
    slope = solved.jac[:n, :]  # of the errors; what the deviations add says nothing of the path
    information = slope.T @ slope
    keep = [*range(count), *range(k - data.coloured, k)] if isinstance(data, BandPowers) else [*range(count)]
    covariance = np.zeros((k, k))
    covariance[np.ix_(keep, keep)] = np.linalg.pinv(information[np.ix_(keep, keep)]) * n / (n - k)
    order = np.argsort(solved.x[1:count:3])  # modes by their frequency
    places = [0, *(1 + 3 * i + j for i in order for j in range(3)), *range(count, k)]
    errors, added = data.residuals(solved.x)
    return PathFit(
        modes=modes, parameters=solved.x[places], covariance=covariance[np.ix_(places, places)],
        criterion=2 * float(solved.cost) + k * max(math.log(n), 2 * n / (n - k - 1)), costs=errors**2 + added**2,
    )  # fmt: skip
