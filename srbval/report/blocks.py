"""What a section of the report may hold besides tables: text, pictures, key-value lists, callouts."""

from collections.abc import Mapping
from dataclasses import dataclass

from srbval.report.badges import Badge, Tone
from srbval.report.figures.files import Drawing
from srbval.report.table import Table, Value, check_identifier

PICTURES = (".svg", ".png")
FIGURES = "figures"  # the folder of pictures and their data beside the documents


@dataclass(frozen=True)
class Paragraph:
    """Running text with inline markup (see `srbval.report.inline`)."""

    text: str


@dataclass(frozen=True)
class Listing:
    """A list of short texts with inline markup, numbered or not."""

    items: tuple[str, ...]
    numbered: bool = False


@dataclass(frozen=True)
class Callout:
    """A boxed remark; its tone is shown as a sign and a word as well as a colour."""

    tone: Tone
    text: str
    title: str = ""


@dataclass(frozen=True)
class Command:
    """A command line or a file's text, set in a box of its own, letter for letter."""

    text: str


@dataclass(frozen=True)
class KeyValues:
    """Pairs of a key and a value, shown as a description list; both plain text, in the order given."""

    pairs: Mapping[str, Value]


@dataclass(frozen=True, kw_only=True)
class Explore:
    """How a page with scripts shows a figure's data again, to be zoomed and read off.

    `x` and the keys of `curves` are columns of the figure's data file, the values what the reader sees; `marks`
    are named places on the x axis; `x_per_order`, if any, is what one shaft order is on it.
    """

    x: str
    x_label: str
    y_label: str
    curves: Mapping[str, str]
    marks: tuple[tuple[str, float], ...] = ()
    x_per_order: float | None = None


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A picture, SVG or PNG by its `suffix`, with the text that replaces it.

    It is drawn when a document that shows it is made: `draw(folder, id)` writes the picture and the plotted data (CSV)
    under that name, see `save_panel`. `label` is the bold start of the caption ("Figure 11a"). `synthetic` marks a
    stand-in: both renderers print so above the caption. A figure on its own takes the whole width of the text unless
    `wide` is False; `explore` says how scripts may show the data. Raises ValueError without alt text or caption.
    """

    id: str
    caption: str
    alt: str
    draw: Drawing
    suffix: str = ".svg"
    synthetic: bool = False
    label: str = ""
    badge: Badge | None = None
    wide: bool = True
    explore: Explore | None = None

    def __post_init__(self) -> None:
        check_identifier(self.id, "figure")
        if not self.alt.strip():
            raise ValueError(f"figure {self.id!r} needs an alt text: say what the picture shows.")
        if not self.caption.strip():
            raise ValueError(f"figure {self.id!r} needs a caption.")
        if self.suffix not in PICTURES:
            raise ValueError(f"figure {self.id!r}: {self.suffix!r} is not one of {', '.join(PICTURES)}.")

    @property
    def picture_name(self) -> str:
        """Where the report keeps the picture, relative to its folder."""
        return f"{FIGURES}/{self.id}{self.suffix}"

    @property
    def data_name(self) -> str:
        """Where the report keeps the plotted data, relative to its folder."""
        return f"{FIGURES}/{self.id}.csv"


@dataclass(frozen=True, kw_only=True)
class FigureGrid:
    """Panels (a), (b), ... side by side in `columns`, with one caption for the whole."""

    figures: tuple[Figure, ...]
    columns: int = 2
    caption: str = ""
    label: str = ""

    def __post_init__(self) -> None:
        if not self.figures:
            raise ValueError("a figure grid needs at least one figure.")
        if not 1 <= self.columns <= 3:
            raise ValueError(f"a figure grid of {self.columns} columns: use 1, 2 or 3.")


Block = Paragraph | Listing | Callout | Command | KeyValues | Table | Figure | FigureGrid
