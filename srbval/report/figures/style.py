"""Common style of all figures: colours by origin of the data, data reduction for small files, helpers for axes."""

import functools
import io
import re
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from importlib import metadata
from itertools import pairwise
from pathlib import Path
from typing import Any, ParamSpec

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from srbval.arrays import FloatArray
from srbval.storage.content_store import ContentStore, content_sha256

P = ParamSpec("P")
version_of = functools.cache(metadata.version)
STYLE_FILE = Path(__file__).with_name("srbval.mplstyle")

# Width and height of a panel [inch]: half and full width of the text.
HALF = (4.2, 2.2)
WIDE = (7.6, 2.9)
TITLE_CHARACTERS_PER_INCH = 10.8  # of the bold 9 pt title

# Okabe & Ito's palette (2008), distinguishable with the common colour-vision deficiencies.
BLUE, VERMILION, GREEN, PURPLE, ORANGE = "#0072B2", "#D55E00", "#00795A", "#8E3B76", "#B26F00"
INK, SOFT, HEALTHY_COLOUR = "#1a2028", "#4e5a68", "#39424d"
# Marker and colour of each of up to seven series.
SERIES = tuple(zip("osD^vPX", (SOFT, ORANGE, PURPLE, INK, GREEN, BLUE, VERMILION), strict=True))
BINS_SHOWN = 1500  # stretches of a long spectrum of which the smallest and largest value are drawn

PanelData = tuple[Any, Mapping[str, ArrayLike]]  # a figure, and the plotted columns by name (with unit)
Drawing = Callable[[Path, str], None]  # draws a panel into a folder under a name, see `Panel`


def picture_bytes(figure: Any, suffix: str) -> bytes:
    """Return a figure as SVG (coordinates rounded, unused ids removed) if `suffix` is ``.svg``, otherwise as PNG."""
    buffer = io.BytesIO()
    if suffix != ".svg":
        figure.savefig(buffer, format="png", metadata={"Software": None}, dpi="figure")
        return buffer.getvalue()
    from matplotlib import rcParams
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    # `savefig` would draw everything twice, the first time only for the layout, which drawing computes as well.
    figure.dpi = rcParams["savefig.dpi"]
    FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None})
    text = re.sub(rb' d="[^"]*"', lambda path: _short(path[0]), buffer.getvalue())
    text = re.sub(rb'( [xy]|translate\()(="|)([^")]*)', lambda m: m[1] + m[2] + _short(m[3]), text)
    used = set(re.findall(rb"#([\w.-]+)", text))
    text = re.sub(rb' id="([^"]*)"', lambda name: name[0] if name[1] in used else b"", text)
    return re.sub(rb">\s*\n\s*<", b">\n<", text)


def _short(path: bytes) -> bytes:
    return re.sub(rb"\s*\n", b" ", re.sub(rb"(\.\d\d)\d+", rb"\1", path))


def extreme_indices(values: FloatArray, bins: int) -> NDArray[np.intp]:
    """Return ascending indices of the smallest and largest value in each of `bins` segments, for plotting."""
    n = len(values)
    if n <= 2 * bins:
        return np.arange(n)
    edges = np.linspace(0, n, bins + 1).astype(int)
    segments = ((start, values[start:stop]) for start, stop in pairwise(edges))
    return np.unique([0, n - 1, *(start + at for start, one in segments for at in (one.argmin(), one.argmax()))])


def thin_spectrum(
    frequency_hz: FloatArray, amplitude: FloatArray, end_hz: float, bins: int
) -> tuple[FloatArray, FloatArray]:
    """Select a spectrum from 0 to `end_hz`, and keep only the points that a plot needs (see `extreme_indices`)."""
    inside = (frequency_hz > 0) & (frequency_hz <= end_hz)
    frequency, height = frequency_hz[inside], amplitude[inside]
    kept = extreme_indices(height, bins)
    return frequency[kept], height[kept]


# Word and colours (strong, light) of the signals of each origin.
ORIGINS = {
    "simulated": ("Simulated", BLUE, "#a9cfe6"),
    "measured": ("Measured", VERMILION, "#f0bd99"),
    "stand-in": ("Synthetic stand-in", PURPLE, "#dab9d0"),
}


def figure_style() -> AbstractContextManager[None]:
    """Context manager: figures drawn inside have the report's style, independent of the user's settings."""
    import matplotlib.style

    return matplotlib.style.context(STYLE_FILE, after_reset=True)


class Panel:
    """A panel to draw: `panel(folder, name)` writes ``name.svg`` and ``name.csv`` to a folder. It can be pickled.

    ``draw(*args, **kwargs)`` returns a figure and the columns of the CSV file. Both files are cached, and drawn again
    only if the arguments, the source code or the libraries have changed.
    """

    def __init__(self, draw: Callable[P, PanelData], *args: P.args, **kwargs: P.kwargs) -> None:
        self.draw, self.args, self.kwargs = draw, args, kwargs
        self.store = ContentStore(kind="figure", computed_by=draw.__module__)
        self.drawn_with = STYLE_FILE.read_bytes(), version_of("matplotlib"), version_of("numpy")

    @functools.cached_property
    def content(self) -> str:
        """Hash of all on which the files depend, apart from the source code."""
        return content_sha256(self.draw.__qualname__, self.args, self.kwargs, *self.drawn_with)

    def is_stored(self) -> bool:
        """Return True if the files are in the cache, so that nothing needs to be drawn."""
        return self.store.load(self.content, dict) is not None

    def files(self) -> Mapping[str, str]:
        """Return the texts of the two files by suffix, from the cache if they are there."""
        files = self.store.load(self.content, dict)
        if files is None:
            with figure_style():
                files = _files_of(*self.draw(*self.args, **self.kwargs))
            self.store.save(self.content, files)
        return files

    def __call__(self, folder: Path, name: str) -> None:
        """Write the two files to `folder`."""
        write_files(self.files(), folder, name)


def write_files(texts: Mapping[str, str], folder: Path, name: str) -> None:
    """Write the files of a panel, given by their `texts` by suffix, to `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    for suffix, text in texts.items():
        (folder / f"{name}{suffix}").write_bytes(text.encode())


def _files_of(figure: Any, columns: Mapping[str, ArrayLike]) -> dict[str, str]:
    """Return a panel's picture (SVG) and data (CSV) as texts, by file suffix."""
    data = pd.DataFrame(dict(columns)).replace([np.inf, -np.inf], np.nan)
    text = data.to_csv(index=False, float_format="%.6g", lineterminator="\n")
    return {".svg": picture_bytes(figure, ".svg").decode(), ".csv": text}


def new_figure(inches: tuple[float, float]) -> Any:
    """Make an empty figure of a width and height [inch], without pyplot."""
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=inches)
    figure._repr_png_ = functools.partial(picture_bytes, figure, ".png")
    return figure


def new_axes(inches: tuple[float, float]) -> Any:
    """Make a figure of a width and height [inch]; return its only axes."""
    return new_figure(inches).add_subplot()


def title_panel(axes: Any, origin: str, letter: str, title: str, pad: float = 17.0) -> None:
    """Set a panel's title, as in ``(a) Simulated · title``, `pad` points above the axes; `origin` sets the colour."""
    word, colour, _ = ORIGINS[origin]
    text = " · ".join(filter(None, (f"({letter}) {word}" if letter else word, title)))
    room = TITLE_CHARACTERS_PER_INCH * axes.figure.get_size_inches()[0]
    if len(text) > 1.4 * room:
        text = text[: int(1.4 * room) - 1] + "…"
    # parse_math: a dollar sign would start a formula
    axes.set_title(text, color=colour, pad=pad, fontsize=9 * min(1.0, room / len(text)), parse_math=False)


def legend_above(axes: Any, points: float = 3.0) -> None:
    """Draw the legend in one row, `points` (1/72 inch) above the axes, so that it covers no curve; each label once."""
    from matplotlib.transforms import offset_copy

    above = offset_copy(axes.transAxes, axes.figure, y=points, units="points")
    place = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "bbox_transform": above}
    spaces = {"borderaxespad": 0, "borderpad": 0, "columnspacing": 1.2, "handletextpad": 0.5}
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    axes.legend(once.values(), once, **place, **spaces, ncols=6, frameon=False)
