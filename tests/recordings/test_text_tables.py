"""Text tables: what is not as it should be is an error that names the line; nothing is dropped or guessed."""

import codecs

import numpy as np
import pytest

from srbval.errors import DataError
from srbval.recordings import load_recording
from srbval.recordings.loaders.text import load_text
from srbval.recordings.registry import FileStatus, add

from . import files

ROWS = 400
X, Y = files.vibration(ROWS).round(4), files.vibration(ROWS, 1).round(4)
TABLE = [f"{a:.4f},{b:.4f}" for a, b in zip(X, Y, strict=True)]
SEMICOLONS = [f"{a:.4f};{b:.4f}".replace(".", ",") for a, b in zip(X, Y, strict=True)]


def read(tmp_path, lines):
    path = tmp_path / "table.csv"
    if not isinstance(lines, bytes):
        lines = (lines if isinstance(lines, str) else "\n".join(lines) + "\n").encode()
    path.write_bytes(lines)
    return dict(load_text(path).variables)


def changed(at, *lines):
    return [*TABLE[:at], *lines, *TABLE[at + 1 :]]


REFUSED = [
    (changed(9, "", "", "0,0"), r"2 line\(s\) blank among the samples, the first is line 10\."),
    (["a,b", *(row + ",0.5" for row in TABLE)], "line 1 has 2 names for 3 columns"),
    (["a,,c", *(row + ",0.5" for row in TABLE)], "line 1 is not a row of numbers, and '' not a column name"),
    (changed(0, "0.12x, 0.3"), "line 1 is not a row of numbers, and '0.12x' not a column name"),
    (["a,a", *TABLE], "line 1 names more than one column 'a'"),
    (changed(7, "0.1"), r"1 line\(s\) do not have 2 fields as line 1 has, the first is line 8\."),
    (changed(0, "0.1"), r"399 line\(s\) do not have 1 fields as line 1 has, the first is line 2\."),
    (changed(7, "0.1,0.2,0.3", "0.1,0.2,", "0.3"), r"3 line\(s\) do not have 2 fields .* first is line 8\."),
    (changed(5, "NaN,0.1", "0.1,inf"), r"2 line\(s\) with a field that is not finite \('NaN'\).* line 6\."),
    (changed(5, "0.1,0.2 V"), r"not finite \('0\.2 V'\).* line 6\."),
    (changed(5, "0.1,0.2 # later"), r"1 line\(s\) with a # after its beginning, the first is line 6\."),
    (changed(5, "#0.1,0.2", "# remark"), r"1 line\(s\) of numbers behind a # among the samples.* line 6"),
    (changed(5, "0.1,0.2\r3"), r"1 line\(s\) with control characters, the first is line 6"),
    ([*(TABLE * 3)[:999], "0.1,0.2\x003", *TABLE], r"1 line\(s\) with control characters, the first is line 1000\."),
    (["# fs = 1000", "# fs = 2000", *TABLE], r"says fs = 1000\.0 and 2000\.0"),
    (codecs.BOM_UTF16_LE + "\n".join(TABLE).encode("utf-16-le")[:-1], "damaged UTF-16 text"),
]
COMMAS = [
    ([row.replace(".", ",") for row in TABLE], "line .* has decimal commas that cannot be told from those between"),
    ([f"{a:.1f}".replace(".", ",") for a in X], "line .*-0,.* has decimal commas that cannot be told"),
    (["x", *(f"{a:.4f}".replace(".", ",") for a in X)], "1 names for 2 columns. .*decimals need a point"),
    (["x", *SEMICOLONS], r"1 names for 2 columns\. Name each\.$"),
    (["12,34", "5,6", "7,08", *["1,1"] * 300], "line 3, '7,08', has decimal commas"),
    ([*SEMICOLONS, "1.234,56;0,1"], "is in a table of both decimal commas and points, or with thousands separators"),
    ([f"{i % 7 + 1},{i:03d};{i % 5 + 1},{i:03d}" for i in range(100, 500)], "three digits after every comma"),
    ([*SEMICOLONS, "1,234,567;0,1"], r"not finite \('1,234,567'\)"),
]


@pytest.mark.parametrize(("lines", "said"), REFUSED + COMMAS)
def test_what_is_refused(tmp_path, lines, said):
    with pytest.raises(DataError, match=said):
        read(tmp_path, lines)
    (entry,) = add(tmp_path).recordings
    assert entry.status is FileStatus.UNREADABLE  # a damaged table is a damaged recording, a readme is none


@pytest.mark.parametrize(
    "lines",
    [
        ["", "", "a,b", "", *TABLE, "", " "],
        ["a,b,", *(row + "," for row in TABLE)],
        ["a,b", *(row + "," for row in TABLE)],
        ['"a","b"', *('"' + row.replace(",", '","') + '"' for row in TABLE)],
        ["a, b", *(row.replace(",", " , ") for row in TABLE)],
        ["a\tb", TABLE[0].replace(",", "\t"), "# a remark of one's own, in between", "#"]
        + [row.replace(",", "\t") for row in TABLE[1:]],
    ],
)
def test_what_is_harmless(tmp_path, lines):
    found = read(tmp_path, lines)
    assert list(found) == ["a", "b"]
    np.testing.assert_array_equal([found["a"], found["b"]], [X, Y])


@pytest.mark.parametrize("separator", [";", "\t", "  "])
@pytest.mark.parametrize("header", [True, False])
def test_decimal_commas(tmp_path, separator, header):
    rows = [row.replace(";", separator) for row in SEMICOLONS]
    found = read(tmp_path, [separator.join("ab")] * header + rows)
    np.testing.assert_array_equal(list(found.values()), [X, Y])
    assert load_text(tmp_path / "table.csv").notes == ("decimal commas read as decimal points",)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("header", ["Beschleunigung [m/s²],b\r\n", ""])
def test_byte_order_marks(tmp_path, encoding, header):
    marks = {"utf-16-le": codecs.BOM_UTF16_LE, "utf-16-be": codecs.BOM_UTF16_BE}
    text = header + "\r\n".join(TABLE)
    (tmp_path / "t.csv").write_bytes(marks.get(encoding, b"") + text.encode(encoding))
    recording = load_recording(tmp_path / "t.csv", channel="b" if header else "col_2", fs_hz=1e4, unit="g")
    assert list(recording.channels) == (["Beschleunigung [m/s²]", "b"] if header else ["col_1", "col_2"])
    np.testing.assert_allclose(recording.channels["b" if header else "col_2"], Y * 9.80665)


def test_line_ends_of_old(tmp_path):
    np.testing.assert_array_equal(list(read(tmp_path, "\r".join(["a,b", *TABLE])).values()), [X, Y])
    assert load_text(tmp_path / "table.csv").notes == ("the last line has no end: the file may have been cut there",)
