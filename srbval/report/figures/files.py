"""Save a panel as a picture and, beside it, the plotted data as CSV; fewer digits and points for both."""

import io
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from srbval.arrays import FloatArray


@dataclass(frozen=True)
class PanelFiles:
    """Where a panel's picture and its data were written."""

    picture: Path
    data: Path


BINS_SHOWN = 1500  # of a spectrum: all of a short one, the least and greatest of each stretch of a long one
Drawing = Callable[[Path, str], PanelFiles]  # draws a panel into a folder under a name, see `save_panel`


def save_panel(
    figure: Any, folder: Path, name: str, columns: Mapping[str, ArrayLike], suffix: str = ".svg"
) -> PanelFiles:
    """Write ``folder/name.svg`` (or ``.png``) and ``folder/name.csv``; the folder is made if need be.

    `columns` maps a unit-named column to its values, all of one length. The same figure gives the same
    bytes: no date is stored.
    """
    folder.mkdir(parents=True, exist_ok=True)
    picture = folder / f"{name}{suffix}"
    picture.write_bytes(picture_bytes(figure, suffix))
    data = folder / f"{name}.csv"
    write_csv(data, columns)
    return PanelFiles(picture=picture, data=data)


def picture_bytes(figure: Any, suffix: str) -> bytes:
    """A figure as SVG (``.svg``) or PNG; call it in the style that the figure was drawn in."""
    return _svg(figure) if suffix == ".svg" else _png(figure)


def _svg(figure: Any) -> bytes:
    """SVG with coordinates to a hundredth of a point, on one line, without names nobody asks for: a smaller file."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None})
    text = re.sub(rb' d="[^"]*"', lambda path: _short(path[0]), buffer.getvalue())
    text = re.sub(rb'( [xy]|translate\()(="|)([^")]*)', lambda m: m[1] + m[2] + _short(m[3]), text)
    used = set(re.findall(rb"#([\w.-]+)", text))
    text = re.sub(rb' id="([^"]*)"', lambda name: name[0] if name[1] in used else b"", text)
    return re.sub(rb">\s*\n\s*<", b">\n<", text)


def _short(path: bytes) -> bytes:
    return re.sub(rb"\s*\n", b" ", re.sub(rb"(\.\d\d)\d+", rb"\1", path))


def _png(figure: Any) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None}, dpi="figure")
    return buffer.getvalue()


def rounded(values: FloatArray) -> FloatArray:
    """Values to four significant digits, for data that are many and only looked at."""
    with np.errstate(divide="ignore"):
        digits = 3 - np.floor(np.log10(np.abs(values)))
    scale = 10.0 ** np.where(np.isfinite(digits), digits, 0)
    return np.asarray(np.round(values * scale) / scale)


def extreme_indices(values: FloatArray, bins: int) -> NDArray[np.intp]:
    """Indices of the least and greatest value of each of `bins` equal stretches, ascending.

    A line through them covers the same pixels as one through all samples. Fewer than 2 `bins` samples
    are all kept.
    """
    n = len(values)
    if n <= 2 * bins:
        return np.arange(n)
    edges = np.linspace(0, n, bins + 1).astype(int)
    kept = {0, n - 1}
    for start, stop in pairwise(edges):
        kept |= {start + int(values[start:stop].argmin()), start + int(values[start:stop].argmax())}
    return np.array(sorted(kept))


def plotted(frequency_hz: FloatArray, amplitude: FloatArray, end_hz: float, bins: int) -> tuple[FloatArray, FloatArray]:
    """A spectrum above zero up to `end_hz`, thinned by `extreme_indices`."""
    inside = (frequency_hz > 0) & (frequency_hz <= end_hz)
    frequency, height = frequency_hz[inside], amplitude[inside]
    kept = extreme_indices(height, bins)
    return frequency[kept], height[kept]


def write_csv(path: Path, columns: Mapping[str, ArrayLike]) -> None:
    """Write columns of numbers, six significant digits, empty where a number is missing."""
    arrays = [np.asarray(values) for values in columns.values()]
    lines = [",".join(columns)]
    lines += [",".join(_text(value) for value in row) for row in zip(*arrays, strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _text(value: Any) -> str:
    if isinstance(value, str):
        return '"' + value.replace('"', '""') + '"'
    return "" if not np.isfinite(value) else f"{value:.6g}"
