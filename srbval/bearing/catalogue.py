"""Bearings known by name, and bearings read from a user's TOML file.

The page "Your own bearing" of the guide describes the file. A bearing known by name has a file in the folder `known` or
a row in `catalogue.csv`. Columns of `catalogue.csv` are `name`, `title`, all keys of a bearing file's tables
`[elements]` and `[orders]`, `source` (a key of `catalogue_sources.csv`), and `also` (other designations of the same
bearing). If a row contains both dimensions and orders, the dimensions are used, because makers round the orders.
Instead of a known bearing's name, `load_bearing` accepts a printed designation (see `designations`) or a text of
numbers: ``elements Z,D,DP,ANGLE`` (as in `[elements]`) or ``orders BPFO,BPFI,BSF,FTF``.
"""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from srbval.bearing.designations import Designation, read_designation, read_table, static_load_n
from srbval.bearing.geometry import SphericalRollerGeometry
from srbval.bearing.kinematics import FaultFrequencies, FaultOrders, RollingElements
from srbval.bridges import NotebookObject
from srbval.errors import ConfigurationError, UnknownNameError, closest_word
from srbval.storage.files import read_limited
from srbval.storage.tables import Limited, build, quantity, read_toml, without_unit

DEFAULT_BEARING, FOLDER = "skf-22240", Path(__file__).parent
# Cages under load slip less; with a light load or much grease a cage may slip by several per cent.
LARGEST_SLIP, MOST_SLIP_PCT = 0.01, 5.0
SUM_TOLERANCE = 0.01  # largest error of BPFO + BPFI in published orders, relative to the number of elements
SPIN_TOLERANCE = 0.05  # largest relative excess of a published BSF over its value at contact angle 0
FTF_TOLERANCE = 0.02  # largest difference of a published FTF from BPFO over the number of elements
MIN_CIRCLE_FILL = 0.25  # least share of the pitch circle that elements fill; real bearings: 0.45 to 0.9
MOST_SUGGESTED = 4
INLINE = {  # values in a name that replaces a file, with their units
    "elements": {"rolling_elements": "", "element_diameter": " mm", "pitch_diameter": " mm", "contact_angle": " deg"},
    "orders": dict.fromkeys(("bpfo", "bpfi", "bsf", "ftf"), ""),
}


@dataclass(frozen=True, kw_only=True)
class Ratings(Limited):
    """Table `[ratings]` of a spherical roller bearing's file: load and speed ratings from the maker's catalogue."""

    static_load_n: float = quantity("force", above=0)
    reference_rad_s: float = quantity("speed", above=0)

    def minimum_load_n(self, shaft_rad_s: float) -> float:
        """Compute the minimum equivalent load that prevents skidding [N] (SKF Rolling bearings, 2018).

        0.003 C_0 for speeds n up to 0.3 of the reference speed n_r, and 0.003 C_0 (1 + 2 sqrt(n / n_r - 0.3)) above;
        C_0: static load rating. Valid up to 2 n_r, extrapolated beyond.
        """
        beyond = max(0.0, shaft_rad_s / self.reference_rad_s - 0.3)
        return 0.003 * self.static_load_n * (1 + 2 * math.sqrt(beyond))


@dataclass(frozen=True, kw_only=True)
class Bearing(NotebookObject):
    """Rolling bearing with its kinematic orders.

    `rolling_elements` counts one row. `geometry` contains all dimensions of a double-row spherical roller bearing,
    `elements` the main dimensions of any bearing. If both are None, `orders` are published values, taken from `source`.
    `ratings` are load and speed ratings from the maker's catalogue, if known. Fault lines are searched for up to a
    deviation of the mean cage speed from its value in pure rolling by the share `largest_slip`.
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

    def overload(self, radial_n: float | None, axial_n: float | None) -> str:
        """Warning if the radial or axial load [N] exceeds the static load rating; empty if not, or without a rating."""
        static_n = self.ratings.static_load_n if self.ratings else static_load_n(self.title)
        load_n = max(radial_n or 0.0, axial_n or 0.0)
        if static_n is None or load_n <= static_n:
            return ""
        return (
            f"a load of {load_n / 1e3:.4g} kN is above the static load rating of the bearing, {static_n / 1e3:.4g} kN: "
            "it would dent the races"
        )

    def summary_table(self) -> tuple[str, dict[str, Any]]:
        """Return a title and a table of the orders and their source, for display in a notebook."""
        about = {"rolling elements of a row": self.rolling_elements, "source": self.source}
        return f"{self.name}: {self.title}", {key.upper(): value for key, value in vars(self.orders).items()} | about

    @property
    def pitch_diameter_m(self) -> float | None:
        """Diameter of the circle through the rolling elements' centres; None if only orders are known."""
        if self.geometry is not None:
            return 2 * self.geometry.pitch_radius_m
        return None if self.elements is None else self.elements.pitch_diameter_m

    def with_slip(self, largest_pct: float) -> "Bearing":
        """Return a copy with `largest_slip` set to `largest_pct` [%], which must be at most `MOST_SLIP_PCT`."""
        if not 0 < largest_pct <= MOST_SLIP_PCT:
            raise ConfigurationError(
                f"largest slip of the cage, {largest_pct:g} %: must be positive and at most {MOST_SLIP_PCT:g} %, "
                "because a wider search for one fault line finds other lines."
            )
        return dataclasses.replace(self, largest_slip=largest_pct / 100)


@dataclass(frozen=True, kw_only=True)
class PublishedOrders(FaultOrders):
    """Table `[orders]` of a bearing file: published fault orders, and the number of rolling elements of a row."""

    rolling_elements: int

    def __post_init__(self) -> None:
        total, count = self.bpfo + self.bpfi, self.rolling_elements
        if not abs(total / count - 1 if count > 0 else 1) <= SUM_TOLERANCE:
            raise ConfigurationError(
                f"orders: bpfo + bpfi = {total:.6g} must be the number of rolling elements of one row, {count}, within "
                f"{SUM_TOLERANCE:.0%}; count one row only, and give multiples of the shaft speed."
            )
        if not abs(self.ftf - self.bpfo / count) <= FTF_TOLERANCE:
            raise ConfigurationError(
                f"orders: ftf = {self.ftf} must be between 0 and 1, within {FTF_TOLERANCE} of bpfo divided by the "
                f"rolling elements of a row, {self.bpfo / count:.4g}; the sequence is BPFO, BPFI, BSF, FTF, and BSF is "
                "the element's spin, not twice the spin."
            )
        ratio = (self.bpfi - self.bpfo) / total  # element over pitch diameter times the cosine of the contact angle
        most = (1 / ratio - ratio) / 2 if ratio > 0 else 0.0
        if self.bsf > (1 + SPIN_TOLERANCE) * most:
            half = self.bsf <= 2 * (1 + SPIN_TOLERANCE) * most
            raise ConfigurationError(
                f"orders: bsf = {self.bsf:g} is impossible with bpfo = {self.bpfo:g} and bpfi = {self.bpfi:g} of "
                f"{count} elements, which spin at most {most:.4g} times per shaft revolution"
                f"{'; did you give 2xBSF? BSF is half of it' if half else '; bpfi must be above bpfo'}."
            )
        super().__post_init__()

    @property
    def orders(self) -> FaultOrders:
        """Fault orders alone, without the number of rolling elements."""
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
    """List the names of the bearings that come with the program, sorted."""
    return tuple(sorted(known_tables()))


def find_bearings(text: str) -> tuple[Bearing, ...]:
    """Find known bearings by designation, or by words in name, title or source; an empty text finds all."""
    if designated := _match_designation(text):
        return tuple(map(load_bearing, designated))
    found = (load_bearing(name) for name in known_bearings())
    words = text.casefold().split()
    return tuple(b for b in found if all(w in f"{b.name} {b.title} {b.source}".casefold() for w in words))


def load_bearing(name_or_path: Bearing | str | Path) -> Bearing:
    """Load a bearing by name (see `known_bearings`) or from a TOML file; a `Bearing` is returned unchanged.

    For a designation as printed on ring and box, the known bearing of this or the most similar designation is loaded,
    and its `title` names both. In a file that describes a machine, the bearing is the table `[bearing]`.

    Raises `ConfigurationError` for an unknown name or impossible values, `DataError` for a missing file.
    """
    if isinstance(name_or_path, Bearing):
        return name_or_path
    path = Path(name_or_path)
    return _read_bearing_file(path, read_limited(path)) if path.suffix == ".toml" else _find_bearing(str(name_or_path))


@lru_cache(maxsize=16)
def _read_bearing_file(path: Path, content: bytes) -> Bearing:
    document = read_toml(path, content)
    if isinstance(document.get("bearing"), dict):  # a machine's file has other tables, too
        document = {"title": document.get("title")} | document["bearing"]
    document = {"source": path.name} | document  # a user's file is its source
    return bearing_from_table(document, path.stem, str(path))


@cache
def _find_bearing(text: str) -> Bearing:
    """Find the bearing with the name or designation `text`; `text` may instead contain dimensions or fault orders."""
    if text.partition(" ")[0] in INLINE:
        return bearing_from_table(_parse_inline(text), text)
    if text in known_tables():
        return bearing_from_table(known_tables()[text], text)
    if designated := _match_designation(text):
        found = load_bearing(designated[0])
        return dataclasses.replace(found, title=f"{text.strip()}, taken as {found.title}")
    raise UnknownNameError(
        f"bearing {text!r} is not known.{_nearest_known(text)} `srbval bearing list` shows the known ones; or give a "
        ".toml file, the bearing's dimensions with --elements or its orders with --orders."
    )


@cache
def _printed_names() -> tuple[tuple[str, Designation], ...]:
    """List pairs of a known bearing's name and a designation in its title, or in column `also` of the catalogue."""
    others = {row["name"]: (row["also"] or "").split() for row in read_table("catalogue.csv")}
    found = (
        (name, read_designation(text))
        for name, table in known_tables().items()
        for text in (table["title"].partition(",")[0].partition(" (")[0], *others.get(name, ()))
    )
    return tuple((name, one) for name, one in found if one is not None)


def _match_designation(text: str) -> list[str]:
    """List the names of known bearings with the designation `text`; if there are none, with a similar designation."""
    printed = read_designation(text)
    for alike in printed.alike if printed else ():
        found = [(one.maker, name) for name, one in _printed_names() if one[1:] == alike]
        own = [name for maker, name in found if printed and printed.maker in ("", maker)]
        if names := own + [name for _, name in found if printed and printed.built_alike and name not in own]:
            return names
    return []


def _nearest_known(text: str) -> str:
    """Suggestion for an unknown bearing: known bearings of its size, or the most similar known name."""
    printed = read_designation(text)
    if printed is None:
        close = None if any(c.isdigit() for c in text) else closest_word(text, known_bearings())
        return f" Did you mean {close!r}?" if close else ""
    same = [(one.kind != printed.kind, name) for name, one in _printed_names() if one.size == printed.size]
    names = dict.fromkeys(name for _, name in sorted(same, key=lambda each: each[0]))
    return f" Known bearings of its size (orders may differ): {', '.join([*names][:MOST_SUGGESTED])}." if same else ""


def bearing_from_table(table: Mapping[str, Any], name: str, where: str = "") -> Bearing:
    """Build a bearing from the contents of a bearing file; `where` names this file in a `ConfigurationError`."""
    file = build(_BearingFile, table, where or name)
    given = [t for t in (file.geometry, file.elements, file.orders) if t is not None]
    if len(given) != 1:
        raise ConfigurationError(
            f"{name}: give exactly one of the tables [geometry], [elements], [orders]; found {len(given)}."
        )
    same = {key: getattr(file, key) for key in ("title", "source", "geometry", "elements", "ratings")}
    bearing = Bearing(name=name, rolling_elements=given[0].rolling_elements, orders=given[0].orders, **same)
    return bearing if file.largest_slip_pct is None else bearing.with_slip(file.largest_slip_pct)


def _parse_inline(text: str) -> Mapping[str, Any]:
    """Convert ``elements Z,D,DP,ANGLE`` or ``orders BPFO,BPFI,BSF,FTF`` to the contents of a bearing file."""
    kind, _, numbers = text.partition(" ")
    units = INLINE[kind]
    try:
        values = dict(zip(units, map(float, numbers.split(",")), strict=True))
    except ValueError:
        raise ConfigurationError(
            f"{text!r}: {len(units)} numbers with commas between them and decimal points are expected: "
            f"{', '.join(f'{name}{unit}' for name, unit in units.items())}."
        ) from None
    if kind == "elements":
        count, diameter, pitch, _ = values.values()
        if not count.is_integer():
            raise ConfigurationError(f"{text!r}: the number of rolling elements of one row, {count:g}, must be whole.")
        if pitch > 0 and (fill := count * diameter / (math.pi * pitch)) < MIN_CIRCLE_FILL:
            raise ConfigurationError(
                f"{text!r}: {count:g} elements of {diameter:g} mm fill {fill:.0%} of a circle of {pitch:g} mm; at "
                f"least {MIN_CIRCLE_FILL:.0%} are expected. Give the number in one row, the diameter of an element and "
                "the diameter (not the radius) of the pitch circle, in mm."
            )
        table: dict[str, Any] = {name: f"{values[name]!r}{unit}" for name, unit in units.items() if unit}
        table["rolling_elements"] = int(count)
    else:
        table = values | {"rolling_elements": round(values["bpfo"] + values["bpfi"])}
    return {"title": f"bearing of {text}", "source": "numbers given by the user", kind: table}


def fault_frequencies(bearing: Bearing | str | Path, *, rpm: float) -> FaultFrequencies:
    """Compute the kinematic fault frequencies of a bearing (or its name or file) at a shaft speed [rpm].

    Raises the errors of `load_bearing`, and `ConfigurationError` for a speed that is no positive number.
    """
    if not (math.isfinite(rpm) and rpm > 0):
        raise ConfigurationError(f"shaft speed {rpm} rpm must be a positive number.")
    return load_bearing(bearing).orders.at(rpm / 60)


@cache
def known_tables() -> Mapping[str, Mapping[str, Any]]:
    """Map the name of each known bearing to the contents of its file, or of its catalogue row in the form of a file."""
    tables = {path.stem: read_toml(path) for path in (FOLDER / "known").glob("*.toml")}
    sources = {row["key"]: row["source"] for row in read_table("catalogue_sources.csv")}
    return tables | {row["name"]: _read_catalogue_row(row, sources) for row in read_table("catalogue.csv")}


def _read_catalogue_row(row: Mapping[str, str], sources: Mapping[str, str]) -> Mapping[str, Any]:
    kind, cls = ("elements", RollingElements) if row["element_diameter"] else ("orders", PublishedOrders)
    keys = {without_unit(field) for field in dataclasses.fields(cls)}
    whole = ("rolling_elements", "rows")
    values = {key: int(value) if key in whole else value for key, value in row.items() if key in keys and value}
    return {"title": row["title"], "source": sources[row["source"]], kind: values}
