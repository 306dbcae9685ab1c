"""Designations as printed on a bearing and its box, and static load ratings by designation.

A designation contains the maker, the type, the size and suffixes. Suffixes for cage, seals, clearance and grease do not
change the fault orders and are ignored. `Designation.mark` contains a suffix that changes the orders: contact angle
``B`` of angular contact ball bearings, reinforced design ``E`` of cylindrical roller bearings, or ``ETN9`` for more
balls in a deep groove ball bearing.
"""

import csv
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

SIZE = re.compile(r"(?<!\d)\d{3,6}(?!\d)")
SEALS_WITHOUT_HYPHEN = re.compile(r"\b(6[0-4]\d\d)2(?=rs|z)")  # as in 62052RS
CYLINDRICAL = ("nu", "nj", "n", "nup")  # with the same rollers for one maker and size
HOUSED_UNIT_TYPES = {"ucp", "ucf", "ucfl", "ucfc", "ucpa", "uct"}  # housings with an insert UC
MATERIALS = {"s", "ss", "e2"}  # stainless steel, low friction
INSERTS = {"uc", "uer", "er", "uk"}  # ball bearings for housings
NEEDLES = {"hk", "bk", "na", "nk", "rna"}
TYPES = {*CYLINDRICAL, *HOUSED_UNIT_TYPES, *MATERIALS, *INSERTS, *NEEDLES, "nn", "sl", "qj", "t"}
CONTACT_ANGLE_MARK = re.compile(r"ac|a5|[abc]|")  # of an angular contact ball bearing


class Designation(NamedTuple):
    """Printed designation: `maker`, type letters `kind`, `number`; `mark`: suffix that changes fault frequencies."""

    maker: str
    kind: str
    number: str
    mark: str

    @property
    def size(self) -> str:
        """Code of outer dimensions and bore, e.g. 206 for 6206, NU 206 and 7206 B, which have the same dimensions."""
        return self.number if self.kind or len(self.number) < 4 else self.number[1:]

    @property
    def built_alike(self) -> bool:
        """True for series 60 to 64, UC, N, NJ, NU, NUP, whose dimensions differ by some 0.1 % between makers."""
        ball = not self.kind and re.fullmatch("6[0-4]..|608", self.number) and not self.mark
        return bool(ball) or self.kind in ("uc", *CYLINDRICAL)

    @property
    def alike(self) -> tuple[tuple[str, str, str], ...]:
        """Designations to look up for this bearing, the most similar first: type letters, number and suffix of each.

        Cylindrical roller bearings N, NJ, NU and NUP of one size have the same rollers; suffix E is the last choice.
        """
        if self.kind not in CYLINDRICAL:
            return (self[1:],)
        kinds, marks = dict.fromkeys((self.kind, *CYLINDRICAL)), dict.fromkeys((self.mark, "e"))
        return tuple((kind, self.number, mark) for mark in marks for kind in kinds)


def read_designation(text: str) -> Designation | None:
    """Parse a printed designation in upper or lower case; None for a text without a size after maker and type."""
    plain = SEALS_WITHOUT_HYPHEN.sub(r"\1-2", text.casefold().replace("_", " "))
    found = SIZE.search(plain)
    if found is None:
        return None
    words, rest = re.findall(r"[^\W_]+", plain[: found.start()]), plain[found.end() :].lstrip(" -./")
    kinds = [word for word in words if word in TYPES]
    maker = [word for word in words if word not in TYPES]
    if len(kinds) > 1 or not all(map(str.isalpha, maker)):
        return None
    kind, number, mark = "".join(kinds), found.group(), ""
    kind = "uc" if kind in HOUSED_UNIT_TYPES else "" if kind in MATERIALS else kind
    if kind in CYLINDRICAL:
        mark = "e" * rest.startswith("e")
    elif not kind and number[0] == "7" and len(number) == 4:
        mark = CONTACT_ANGLE_MARK.match(rest).group()  # type: ignore[union-attr]  # it also matches an empty text
    elif number[0] == "6":
        mark = "etn" * rest.startswith("etn")
    elif not kind and len(number) == 3:
        mark = rest[:1]
    return Designation(" ".join(maker), kind, number, mark)


@cache
def static_load_n(text: str) -> float | None:
    """Look up the static load rating C_0 [N] of the bearing with the designation `text`; None if it is not known.

    The source is ``static_ratings.csv``, SKF's catalogue ratings [kN] by series and bore. Ratings of other makers
    differ by some per cent.
    """
    printed = read_designation(text)
    if printed is None or printed.kind not in ("", *CYLINDRICAL):
        return None
    series = f"{'nu' if printed.kind else ''}{printed.number[:-2]}{printed.mark}"
    ratings = next((row for row in read_table("static_ratings.csv") if row["series"].casefold() == series), {})
    rating = ratings.get(printed.number[-2:])
    return 1e3 * float(rating) if rating else None


def read_table(name: str) -> Iterator[Mapping[str, str]]:
    """Read the rows of the CSV file `name` in this folder; all values are text."""
    return csv.DictReader(Path(__file__).with_name(name).read_text(encoding="utf-8").splitlines())
