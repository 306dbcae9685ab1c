"""The report as a tagged PDF (PDF/UA-1), typeset by typst from the same plain tree as the page."""

import json
import re
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any

from srbval.errors import ConfigurationError
from srbval.report.model import Document, Report
from srbval.report.plain import as_plain

# A run of characters without a blank longer than this may be broken anywhere, or it would leave the page.
LONGEST_WORD = 28
LONGEST_IN_CELL = 14  # in a table: a longer one may be broken between its parts


def require_typst() -> Any:
    """Import typst, or say how to install it."""
    try:
        import typst
    except ImportError:
        raise ConfigurationError(
            'the PDF needs typst, which is not installed: pip install "srbval[pdf]", or leave the PDF out.'
        ) from None
    return typst


def render_pdf(
    report: Report, folder: Path, document: Document = Document.MAIN, *, with_appendix: bool = False
) -> bytes:
    """Typeset one document of `report`, whose pictures already lie in ``folder/figures``.

    All text travels as JSON data, never as markup, so nothing in it can be executed. The PDF is dated
    with the report's own time: the same report gives the same bytes. Raises `ConfigurationError` without
    typst and typst's own error (a bug here) when the document does not compile.
    """
    typst = require_typst()
    content: bytes = typst.compile(
        (resources.files("srbval.report") / "templates" / "report.typ").read_bytes(),
        root=str(folder),
        format="pdf",
        font_paths=[str(_font_folder())],
        ignore_system_fonts=True,
        sys_inputs={"report": json.dumps(_displayable(as_plain(report, document, with_appendix=with_appendix)))},
        pdf_standards=["ua-1"],
        timestamp=int(report.generated_utc.timestamp()),
    )
    return content


def _font_folder() -> Path:
    import matplotlib

    return Path(matplotlib.get_data_path()) / "fonts" / "ttf"


@lru_cache(maxsize=1)
def _known_characters() -> frozenset[int]:
    """Characters the text font can draw; PDF/UA refuses a document that asks for another."""
    from matplotlib.ft2font import FT2Font

    return frozenset(FT2Font(str(_font_folder() / "DejaVuSans.ttf")).get_charmap())


def _displayable(value: Any) -> Any:
    """Make every string of the tree drawable: unknown characters replaced, endless words breakable."""
    if isinstance(value, dict) and "number" in value:  # a cell: file names may be broken where their parts meet
        value = value | {key: _breakable(value[key]) for key in ("text", "note")}
    if isinstance(value, dict):
        return {key: item if key in ("picture", "kind") else _displayable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_displayable(item) for item in value]
    return _displayable_text(value) if isinstance(value, str) else value


def _breakable(text: str) -> str:
    """Let words too long for a narrow column be broken after a slash or an underscore."""
    return re.sub(rf"\S{{{LONGEST_IN_CELL},}}", lambda word: re.sub(r"(?<=[/_])(?=[^/_])", "\u200b", word[0]), text)


def _displayable_text(text: str) -> str:
    known = _known_characters()
    shown = "".join(c if c in "\n\t" or ord(c) in known else "\ufffd" for c in text)
    return re.sub(rf"\S{{{LONGEST_WORD}}}(?=\S)", lambda match: match[0] + "\u200b", shown)
