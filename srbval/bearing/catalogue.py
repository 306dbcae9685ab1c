"""Bearings known by name, and bearings read from a user's TOML file.

The page "Your own bearing" of the guide describes the file. The bearings known by name are files in `known` and rows of
`catalogue.csv`, whose columns are the keys of the tables `[elements]` and `[orders]` and a key of
`catalogue_sources.csv`. If a row has both, the dimensions count; the orders are the maker's rounded ones. A name may
also be the numbers themselves, ``elements Z,D,DP,ANGLE`` or ``orders BPFO,BPFI,BSF,FTF``.
"""

import csv
import dataclasses
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from srbval.bearing.geometry import SphericalRollerGeometry
from srbval.bearing.kinematics import FaultFrequencies, FaultOrders, RollingElements
from srbval.errors import ConfigurationError, UnknownNameError, nearest
from srbval.storage.tables import Limited, build, quantity, read_toml

DEFAULT_BEARING, FOLDER = "skf-22240", Path(__file__).parent
# Cages under load slip by less than this; a light load or much grease lets one slip by several per cent.
LARGEST_SLIP, MOST_SLIP_PCT = 0.01, 5.0
SUM_TOLERANCE = 0.01  # of the number of elements, by which published race orders may fail to add up to it
FTF_TOLERANCE = 0.02  # by which a published FTF may differ from BPFO over the number of elements
LEAST_FILL = 0.25  # of the pitch circle that the elements fill: built are 0.45 to 0.9
INLINE = {  # what a name may state in place of a file, with the units
    "elements": {"rolling_elements": "", "element_diameter": " mm", "pitch_diameter": " mm", "contact_angle": " deg"},
    "orders": dict.fromkeys(("bpfo", "bpfi", "bsf", "ftf"), ""),
}


@dataclass(frozen=True, kw_only=True)
class Ratings(Limited):
    """The table `[ratings]` of a spherical roller bearing's file: ratings of its catalogue."""

    static_load_n: float = quantity("force", above=0)
    reference_rad_s: float = quantity("speed", above=0)

    def minimum_load_n(self, shaft_rad_s: float) -> float:
        """Least equivalent load at which rollers do not skid, by SKF Rolling bearings, 2018, spherical roller bearings.

        0.003 C_0 up to 0.3 of the reference speed n_r, and 0.003 C_0 (1 + 2 sqrt(n / n_r - 0.3)) above; stated there
        up to 2 n_r, extrapolated beyond.
        """
        beyond = max(0.0, shaft_rad_s / self.reference_rad_s - 0.3)
        return 0.003 * self.static_load_n * (1 + 2 * math.sqrt(beyond))


@dataclass(frozen=True, kw_only=True)
class Bearing:
    """A rolling bearing.

    `rolling_elements` counts one row. `geometry` is there only for spherical roller bearings that the full model can
    simulate, `elements` for others whose dimensions are known; if both are None, `orders` come from the published
    table in `source`. `ratings`: load and speed of its catalogue, if known. Its lines are looked for up to a
    mean slip of the cage of `largest_slip`, a share of the cage's speed.
    """

    name: str
    title: str
    source: str
    rolling_elements: int
    orders: FaultOrders
    geometry: SphericalRollerGeometry | None = None
    elements: RollingElements | None = None
    largest_slip: float = LARGEST_SLIP
    ratings: Ratings | None = None

    @property
    def pitch_diameter_m(self) -> float | None:
        """Diameter of the circle on which the rolling elements' centres lie; None if only orders are known."""
        if self.geometry is not None:
            return 2 * self.geometry.pitch_radius_m
        return None if self.elements is None else self.elements.pitch_diameter_m

    def with_slip(self, largest_pct: float) -> "Bearing":
        """The bearing with its lines looked for up to this mean slip of the cage [%]; not beyond `MOST_SLIP_PCT`."""
        if not 0 < largest_pct <= MOST_SLIP_PCT:
            raise ConfigurationError(
                f"largest slip of the cage, {largest_pct:g} %: must be positive and at most {MOST_SLIP_PCT:g} %, "
                "because in wider windows one line is mistaken for another."
            )
        return dataclasses.replace(self, largest_slip=largest_pct / 100)


@dataclass(frozen=True, kw_only=True)
class PublishedOrders(FaultOrders):
    """The table `[orders]` of a bearing file."""

    rolling_elements: int

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
        if abs(self.ftf - self.bpfo / count) > FTF_TOLERANCE:
            raise ConfigurationError(
                f"orders: ftf = {self.ftf} must be bpfo over the rolling elements of a row, {self.bpfo / count:.4g}, "
                f"within {FTF_TOLERANCE}; the order is BPFO, BPFI, BSF, FTF, and BSF is the element's spin, once."
            )
        super().__post_init__()

    @property
    def orders(self) -> FaultOrders:
        """The orders alone."""
        return FaultOrders(bpfo=self.bpfo, bpfi=self.bpfi, bsf=self.bsf, ftf=self.ftf)


@dataclass(frozen=True, kw_only=True)
class _BearingFile:
    title: str
    source: str
    geometry: SphericalRollerGeometry | None = None
    elements: RollingElements | None = None
    orders: PublishedOrders | None = None
    largest_slip_pct: float | None = None
    ratings: Ratings | None = None


def known_bearings() -> tuple[str, ...]:
    """Names of the bearings that ship with the program, sorted."""
    return tuple(sorted({*(path.stem for path in (FOLDER / "known").glob("*.toml")), *catalogue_rows()}))


def find_bearings(text: str) -> tuple[Bearing, ...]:
    """Known bearings with each word of `text` in name, title or source, in any case; all for an empty text."""
    found = (load_bearing(name) for name in known_bearings())
    words = text.casefold().split()
    return tuple(b for b in found if all(w in f"{b.name} {b.title} {b.source}".casefold() for w in words))


def load_bearing(name_or_path: Bearing | str | Path) -> Bearing:
    """Load a bearing by name (see `known_bearings`) or from a TOML file; a bearing itself is returned as it is.

    The file may be a machine's, with the bearing's tables below `[bearing]`.

    Raises `ConfigurationError` for an unknown name or impossible values, `DataError` for a missing file.
    """
    if isinstance(name_or_path, Bearing):
        return name_or_path
    text = str(name_or_path)
    if text.partition(" ")[0] in INLINE:
        return bearing_from_table(_inline(text), text)
    if text in catalogue_rows():
        return bearing_from_table(catalogue_rows()[text], text)
    known = text in known_bearings()
    if known or text.endswith(".toml"):
        path = FOLDER / "known" / f"{text}.toml" if known else Path(text)
        document = read_toml(path)
        if isinstance(document.get("bearing"), dict):  # a machine's file contains it among other things
            document = {"title": document.get("title")} | document["bearing"]
        document = {"source": path.name} | document  # a user's own file is its own source
        return bearing_from_table(document, path.stem, text if known else str(path))
    close = None if text.isdigit() else nearest(text, known_bearings())  # another size is another bearing
    hint = f" Did you mean {close!r}?" if close else ""
    raise UnknownNameError(
        f"bearing {text!r} is not known.{hint} `srbval bearing list` shows the known ones; or give a .toml file, its "
        "dimensions with --elements or its orders with --orders."
    )


def bearing_from_table(table: Mapping[str, Any], name: str, where: str = "") -> Bearing:
    """A bearing from the content of a file, `where` (its name); `ConfigurationError` for impossible values."""
    file = build(_BearingFile, table, where or name)
    given = [t for t in (file.geometry, file.elements, file.orders) if t is not None]
    if len(given) != 1:
        raise ConfigurationError(
            f"{name}: give exactly one of the tables [geometry], [elements], [orders]; found {len(given)}."
        )
    same = {key: getattr(file, key) for key in ("title", "source", "geometry", "elements", "ratings")}
    bearing = Bearing(name=name, rolling_elements=given[0].rolling_elements, orders=given[0].orders, **same)
    return bearing if file.largest_slip_pct is None else bearing.with_slip(file.largest_slip_pct)


def _inline(text: str) -> Mapping[str, Any]:
    """The table that a file of this bearing would hold, from ``elements Z,D,DP,ANGLE`` or the orders."""
    kind, _, numbers = text.partition(" ")
    units, words = INLINE[kind], [word.strip() for word in numbers.split(",")]
    try:
        values = dict(zip(units, map(float, words), strict=True))
    except ValueError:
        raise ConfigurationError(
            f"{text!r}: {len(units)} numbers with commas between them and decimal points are expected: "
            f"{', '.join(f'{name}{unit}' for name, unit in units.items())}."
        ) from None
    if kind == "elements":
        count, diameter, pitch, _ = values.values()
        if not count.is_integer():
            raise ConfigurationError(f"{text!r}: the number of rolling elements of one row, {count:g}, must be whole.")
        if pitch > 0 and (fill := count * diameter / (math.pi * pitch)) < LEAST_FILL:
            raise ConfigurationError(
                f"{text!r}: {count:g} elements of {diameter:g} mm fill {fill:.0%} of a circle of {pitch:g} mm; at "
                f"least {LEAST_FILL:.0%} are expected. Give number of one row, diameter of an element, diameter (no "
                "radius) of the pitch circle, in mm."
            )
        table: dict[str, Any] = {name: f"{values[name]!r}{unit}" for name, unit in units.items() if unit}
        table["rolling_elements"] = int(count)
    else:
        table = values | {"rolling_elements": round(values["bpfo"] + values["bpfi"])}
    return {"title": f"bearing of {text}", "source": "numbers given by the user", kind: table}


def fault_frequencies(bearing: Bearing | str | Path, *, rpm: float) -> FaultFrequencies:
    """Kinematic fault frequencies of a bearing, or of one by its name or file, at a shaft speed [rpm].

    Raises what `load_bearing` raises, and `ConfigurationError` for a speed that is no positive number.
    """
    if not (math.isfinite(rpm) and rpm > 0):
        raise ConfigurationError(f"shaft speed {rpm} rpm must be a positive number.")
    return load_bearing(bearing).orders.at(rpm / 60)


@cache
def catalogue_rows() -> Mapping[str, Mapping[str, Any]]:
    """The rows of the catalogue by name, each as the table that a file of that bearing would hold."""
    sources = {row["key"]: row["source"] for row in read_table("catalogue_sources.csv")}
    return {row["name"]: _table(row, sources) for row in read_table("catalogue.csv")}


def read_table(name: str) -> Iterator[Mapping[str, str]]:
    """The rows of one of the catalogue's files, as they are written."""
    return csv.DictReader((FOLDER / name).read_text(encoding="utf-8").splitlines())


def _table(row: Mapping[str, str], sources: Mapping[str, str]) -> Mapping[str, Any]:
    kind, cls = ("elements", RollingElements) if row["element_diameter"] else ("orders", PublishedOrders)
    keys = {f.name: f.name for f in dataclasses.fields(cls)}
    keys |= {name.rsplit("_", 1)[0]: name for name in keys if name.endswith(("_m", "_rad"))}
    filled = {key: value for key, value in row.items() if key in keys and value}
    values = {key: int(value) if key in ("rolling_elements", "rows") else value for key, value in filled.items()}
    return {"title": row["title"], "source": sources[row["source"]], kind: values}
