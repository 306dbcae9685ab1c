"""The look of the figures: one style file, one colour and one line style for each origin."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import resources
from typing import Any

# Width and height of a panel [inch]: half and full width of the text.
HALF = (4.2, 2.55)
WIDE = (7.6, 2.9)
SIZES = {"half": HALF, "wide": WIDE}

# Okabe & Ito's palette (2008), told apart by the common colour-vision deficiencies.
BLUE, VERMILION, GREEN, PURPLE, ORANGE = "#0072B2", "#D55E00", "#00795A", "#8E3B76", "#B26F00"
INK, SOFT, HEALTHY = "#1a2028", "#4e5a68", "#6b7480"


@dataclass(frozen=True)
class OriginStyle:
    """How signals of one origin are named and drawn."""

    word: str
    colour: str
    light: str
    line: str
    stamped: bool = False


ORIGINS = {
    "simulated": OriginStyle("Simulated", BLUE, "#a9cfe6", "-"),
    "measured": OriginStyle("Measured", VERMILION, "#f0bd99", "-"),
    "stand-in": OriginStyle("Synthetic stand-in", PURPLE, "#dab9d0", "-", stamped=True),
}


def origin_style(origin: str) -> OriginStyle:
    """Style of an origin (``simulated``, ``measured``, ``stand-in``); ValueError for anything else."""
    try:
        return ORIGINS[str(origin)]
    except KeyError:
        raise ValueError(f"origin {origin!r} is not one of {', '.join(ORIGINS)}.") from None


@contextmanager
def figure_style() -> Iterator[None]:
    """Draw inside this context: the report's style whatever the user's own settings are."""
    import matplotlib as mpl

    with mpl.rc_context(), resources.as_file(resources.files(__package__) / "srbval.mplstyle") as path:
        mpl.rcdefaults()
        mpl.rcParams.update(mpl.rc_params_from_file(path, use_default_template=False))
        yield


def new_axes(size: str = "half") -> tuple[Any, Any]:
    """A figure of the given size (``half`` or ``wide``) and its one pair of axes, without pyplot."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZES[size])
    FigureCanvasAgg(figure)
    return figure, figure.add_subplot()


def title_panel(axes: Any, origin: str, letter: str, title: str) -> None:
    """Head a panel ``(a) Simulated · title``, in the origin's colour."""
    style = origin_style(origin)
    parts = [f"({letter}) {style.word}" if letter else style.word, title]
    axes.set_title(" · ".join(part for part in parts if part), color=style.colour)


def stamp_stand_in(axes: Any, origin: str) -> None:
    """Stamp SYNTHETIC STAND-IN across the picture when the signal is one; else do nothing."""
    if not origin_style(origin).stamped:
        return
    from matplotlib.patheffects import withStroke

    width, height = axes.figure.get_size_inches()
    axes.text(
        0.5, 0.5, "SYNTHETIC STAND-IN", transform=axes.transAxes, ha="center", va="center", zorder=50,
        fontsize=min(4.6 * width, 8.5 * height), fontweight="bold", rotation=14, color="#a3161f", alpha=0.62,
        path_effects=[withStroke(linewidth=3, foreground="white", alpha=0.75)],
    )  # fmt: skip
    for spine in axes.spines.values():
        spine.set(visible=True, edgecolor="#a3161f", linewidth=1.4, linestyle=(0, (4, 2)))
