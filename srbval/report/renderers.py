"""Renderers of a report: one HTML file that needs no network and no script, and an accessible PDF (PDF/UA-1)."""

import base64
import hashlib
import json
import re
from functools import lru_cache, partial
from importlib import metadata, resources
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from markupsafe import Markup

from srbval.report.blocks import Report
from srbval.report.plain import as_plain
from srbval.storage.installation import import_library

# Characters of a data URI that need an escape in a quoted attribute.
_ESCAPED = re.compile(rb"[^\w !$'()*+,\-./:;=?@\[\]^{|}~]")
_MEDIA_TYPES = {".svg": "image/svg+xml", ".csv": "text/csv"}
# In the PDF, a longer run of characters without a blank may be broken anywhere, so that it does not leave the page.
MAX_WORD = 28
_SEPARATOR = re.compile(r"(?<=[/_])(?=[^/_])")
MAX_CELL_WORD = 14  # in a table cell, a longer run may be broken between its parts


def _template(name: str) -> str:
    return (resources.files("srbval.report") / "templates" / name).read_text(encoding="utf-8")


def render_html(report: Report, folder: Path) -> str:
    """Render a report as one HTML page that contains the pictures and data from ``folder/figures``.

    The template engine escapes all text. Raises FileNotFoundError if a file of a figure is missing.
    """
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    style, script = _template("report.css"), _template("report.js")
    if any(figure.explore for figure in report.figures()):
        style += _template("uplot/uPlot.min.css")
        script = f"/* {_template('uplot/LICENSE')} */ {_template('uplot/uPlot.iife.min.js')}{script}"
    return environment.from_string(_template("report.html.j2")).render(
        report=as_plain(report),
        style=style,
        script=script,
        script_hash=base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii"),
        carried=partial(_data_uri, folder),
    )


def _data_uri(folder: Path, name: str) -> Markup:
    """Encode a file as a data URI for an HTML attribute, percent-encoded, which is shorter than base64."""
    path = folder / name
    kind, content = _MEDIA_TYPES[path.suffix], path.read_bytes()
    if kind == "image/svg+xml":
        content = re.sub(rb">\s*\n\s*<", b"><", content)
        content = content if b"'" in content else content.replace(b'"', b"'")
    escaped = _ESCAPED.sub(lambda character: b"%%%02X" % ord(character[0]), content)
    return Markup(f"data:{kind};charset=utf-8,{escaped.decode('ascii')}")


def require_typst() -> Any:
    """Import typst, or raise an error with the command that installs it."""
    return import_library("typst", "writing the report as PDF (omitted with --no-pdf)")


def render_pdf(report: Report, folder: Path) -> bytes:
    """Typeset a report, whose pictures are in ``folder/figures``, as a PDF; equal reports give equal bytes.

    Text is passed as JSON data, so that nothing in it can be executed. Raises `ConfigurationError` if typst is missing,
    and typst's own error, a sign of a bug in srbval, if the document does not compile.
    """
    content: bytes = require_typst().compile(
        _template("report.typ").encode("utf-8"),
        root=str(folder),
        format="pdf",
        font_paths=[str(_font_folder())],
        ignore_system_fonts=True,
        sys_inputs={"report": json.dumps(_displayable(as_plain(report)))},
        pdf_standards=["ua-1"],
        timestamp=int(report.generated_utc.timestamp()),
    )
    return content


def list_pdf_dependencies() -> list[Any]:
    """Return the template and the versions of the libraries on which a PDF depends; matplotlib provides the fonts."""
    versions = [metadata.version(name) for name in ("typst", "matplotlib") if find_spec(name)]
    return [_template("report.typ"), *versions]


def _font_folder() -> Path:
    import matplotlib

    return Path(matplotlib.get_data_path()) / "fonts" / "ttf"


@lru_cache(maxsize=1)
def _known_characters() -> frozenset[int]:
    """Return the code points that the PDF's font can display; PDF/UA forbids characters without a glyph."""
    from matplotlib.ft2font import FT2Font

    return frozenset(FT2Font(str(_font_folder() / "DejaVuSans.ttf")).get_charmap())


def _displayable(value: Any) -> Any:
    """Replace characters that the PDF's font lacks in all strings, and allow line breaks inside long words."""
    if isinstance(value, dict):
        shown = {key: item if key in ("file", "kind") else _displayable(item) for key, item in value.items()}
        for key in ("text", "note") if "number" in value else ():  # a cell, such as a file's name
            parts = re.sub(rf"\S{{{MAX_CELL_WORD},}}", lambda word: _SEPARATOR.sub("\u200b", word[0]), value[key])
            shown[key] = _displayable_text(parts)
        return shown
    if isinstance(value, list | tuple):
        return [_displayable(item) for item in value]
    return _displayable_text(value) if isinstance(value, str) else value


def _displayable_text(text: str) -> str:
    known = _known_characters()
    shown = "".join(c if c in "\n\t" or ord(c) in known else "\ufffd" for c in text)
    return re.sub(rf"\S{{{MAX_WORD}}}(?=\S)", lambda match: match[0] + "\u200b", shown)
