"""Bearings known by name, and bearings read from a user's TOML file.

A bearing file has a `title`, a `source` and one of three tables: `[geometry]` (spherical roller bearing,
all of the paper's Table 1), `[elements]` (number, diameters, contact angle) or `[orders]` (published).
"""

import difflib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from srbval.bearing.geometry import SphericalRollerGeometry
from srbval.bearing.kinematics import FaultOrders
from srbval.config.strict import build, quantity, read_toml
from srbval.errors import ConfigurationError

DEFAULT_BEARING = "skf-22240"
SUM_TOLERANCE = 0.01  # of the number of elements, by which published race orders may fail to add up to it


@dataclass(frozen=True, kw_only=True)
class Bearing:
    """A rolling bearing.

    `rolling_elements` counts one row. `geometry` is there only for bearings the bundled model can
    simulate; the orders of the others come from their dimensions or from a published table, as `source` says.
    """

    name: str
    title: str
    source: str
    rolling_elements: int
    orders: FaultOrders
    geometry: SphericalRollerGeometry | None = None


@dataclass(frozen=True, kw_only=True)
class _Elements:
    rolling_elements: int
    element_diameter_m: float = quantity("length")
    pitch_diameter_m: float = quantity("length")
    contact_angle_rad: float = quantity("angle")


@dataclass(frozen=True, kw_only=True)
class _Orders:
    rolling_elements: int
    bpfo: float
    bpfi: float
    bsf: float
    ftf: float

    def __post_init__(self) -> None:
        total, count = self.bpfo + self.bpfi, self.rolling_elements
        if not abs(total / count - 1 if count > 0 else 1) <= SUM_TOLERANCE:
            raise ConfigurationError(
                f"orders: bpfo + bpfi = {total:.6g} must be the number of rolling elements of one row, {count}, within "
                f"{SUM_TOLERANCE:.0%}; count one row only, and give orders of the shaft's speed."
            )
        if not 0 < self.ftf < 1:
            raise ConfigurationError(
                f"orders: ftf = {self.ftf} must lie between 0 and 1, in orders of the shaft's speed."
            )


@dataclass(frozen=True, kw_only=True)
class _BearingFile:
    title: str
    source: str
    geometry: SphericalRollerGeometry | None = None
    elements: _Elements | None = None
    orders: _Orders | None = None


def known_bearings() -> tuple[str, ...]:
    """Names of the bearings that ship with the program, sorted."""
    return tuple(sorted(p.name.removesuffix(".toml") for p in _folder().iterdir() if p.name.endswith(".toml")))


def load_bearing(name_or_path: str | Path) -> Bearing:
    """Load a bearing by name (see `known_bearings`) or from a TOML file.

    Raises `ConfigurationError` for an unknown name or impossible values, `DataError` for a missing file.
    """
    text = str(name_or_path)
    known = text in known_bearings()
    if known or text.endswith(".toml"):
        path = Path(str(_folder() / f"{text}.toml")) if known else Path(text)
        return _assemble(build(_BearingFile, read_toml(path), text if known else str(path)), path.stem)
    close = difflib.get_close_matches(text, known_bearings(), n=1, cutoff=0.4)
    hint = f" Did you mean {close[0]!r}?" if close else ""
    raise ConfigurationError(
        f"bearing {text!r} is not known.{hint} Known: {', '.join(known_bearings())}; or give a .toml file."
    )


def _folder() -> resources.abc.Traversable:
    return resources.files("srbval.bearing") / "known"


def _assemble(file: _BearingFile, name: str) -> Bearing:
    given = [t for t in (file.geometry, file.elements, file.orders) if t is not None]
    if len(given) != 1:
        raise ConfigurationError(
            f"{name}: give exactly one of the tables [geometry], [elements], [orders]; found {len(given)}."
        )
    elements = file.elements
    if file.geometry is not None:
        g = file.geometry
        elements = _Elements(
            rolling_elements=g.rollers_per_row,
            element_diameter_m=g.roller_diameter_m,
            pitch_diameter_m=2 * g.pitch_radius_m,
            contact_angle_rad=g.tilt_rad,
        )
    if elements is not None:
        count, orders = elements.rolling_elements, FaultOrders.from_dimensions(**vars(elements))
    else:
        values = dict(vars(file.orders))
        count, orders = values.pop("rolling_elements"), FaultOrders(**values)
    return Bearing(
        name=name, title=file.title, source=file.source, rolling_elements=count, orders=orders, geometry=file.geometry
    )
