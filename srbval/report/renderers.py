"""Files of a report: an HTML page that needs no network and no script, an accessible PDF (PDF/UA-1), JSON, figures.

Page and PDF show the same nested dicts of formatted text (`as_plain`): numbers are formatted only there. The markup of
texts is ``**strong**`` and ```code```; a backslash before ``*``, a backtick or a backslash makes it text.
"""

import base64
import enum
import hashlib
import itertools
import json
import re
import tempfile
from collections.abc import Collection, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from datetime import UTC, datetime
from functools import lru_cache, partial
from importlib import resources
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pandas as pd
from markupsafe import Markup

from srbval import __version__
from srbval.errors import ConfigurationError, DataError
from srbval.processes.machine import usable_cores
from srbval.processes.worker import in_processes
from srbval.report.blocks import FIGURES_FOLDER, OF_VALUE, Report, ReportTable, TableColumn, Tone, cell_text
from srbval.report.figures.style import Panel, version_of, write_files
from srbval.storage.content_store import ContentStore, content_sha256
from srbval.storage.installation import import_library
from srbval.storage.json_files import move_listed_files, to_json

FORMATS: tuple[str, ...] = ("html", "pdf", "json")
FIGURES_PER_PROCESS = 8  # a process takes as long to start as it takes to draw some four figures
PDF_STORE = ContentStore(kind="pdf", computed_by=__name__)
UNESCAPED = " !$'()*+,-./:;=?@[]^{|}~"  # characters that a data URI may contain in a quoted attribute
_MEDIA_TYPES = {".svg": "image/svg+xml", ".csv": "text/csv"}
# In the PDF, a line may end between the parts of a long word, such as a file's name, and anywhere in a longer one.
LONG_WORD, MAX_WORD = r"\S{14,}", 28
_SEPARATOR = re.compile(r"(?<=[/_])(?=\w)")
Span = tuple[str, str]  # (kind, text); kind is one of "text", "strong", "code"
MAX_OPEN_SECTIONS = 3  # sections of a page without folds; a page with more sections folds them
MARKUP = {"caption", "headline", "items", "kicker", "notes", "points", "text"}  # fields with inline markup
_TOKEN = re.compile(r"\\(?P<escaped>[*`\\])|\*\*(?P<strong>[^*]+)\*\*|`(?P<code>[^`]+)`|(?P<text>.)", re.DOTALL)
# C0 and C1 controls but tab and newline, lone surrogates, direction overrides, non-characters.
_UNPRINTABLE = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")
# Where a line must not end: between a number and its unit, and on both sides of a plus-minus sign.
_WITHIN_QUANTITY = re.compile(
    r"(?<=\d) (?=(?:%|°|dB|rpm|[kM]?Hz|k?N|[mµn]?m|[mµn]?s|m/s²?|h|min)(?![\w/]))| (?=±)|(?<=±) "
)


def mask_controls(text: str) -> str:
    """Replace characters that no page can print (controls, lone surrogates, direction overrides) by U+FFFD."""
    return _UNPRINTABLE.sub("\ufffd", text)


def spans(text: str) -> tuple[Span, ...]:
    """Split a text with markup into (kind, text) pieces; join a number and its unit by a no-break space."""
    pieces = ((str(match.lastgroup), match[match.lastindex or 0]) for match in _TOKEN.finditer(text))
    found = list[Span]()
    for kind, neighbours in itertools.groupby(pieces, key=lambda piece: piece[0].replace("escaped", "text")):
        if part := mask_controls("".join(piece for _, piece in neighbours)):
            found.append((kind, part if kind == "code" else _WITHIN_QUANTITY.sub("\u00a0", part)))
    return tuple(found)


def as_plain(report: Report) -> dict[str, Any]:
    """Convert a report to dicts, lists and strings; text with markup becomes a list of (kind, text) pieces."""
    few = len(report.sections) <= MAX_OPEN_SECTIONS
    shown = tuple(replace(one, open=one.open or few) for one in report.sections if one.blocks)
    about = {"made_by": f"srbval {__version__}", "generated": f"{datetime.now(UTC):%Y-%m-%d}"}
    return about | _plain(replace(report, sections=shown, data={}))


def _plain(value: Any, name: str = "") -> Any:
    """Convert a value in the report's field `name` to text, list or dict; a dict's `kind` is its dataclass's name."""
    if isinstance(value, enum.Enum):
        return value.value
    if isinstance(value, str):
        return spans(value) if name in MARKUP else mask_controls(value)
    if isinstance(value, list | tuple):
        return [_plain(item, name) for item in value]
    if not is_dataclass(value):
        return value
    names = (*(field.name for field in fields(value)), *getattr(value, "JSON_PROPERTIES", ()))
    parts = {name: getattr(value, name) for name in names if name != "draw"}
    if isinstance(value, ReportTable):
        parts["rows"] = [list(_cells(row, value.columns)) for row in value.rows]
        parts["columns"] = list(value.columns.values())
    found = {"kind": type(value).__name__} | {key: _plain(item, key) for key, item in parts.items()}
    if parts.get("tone"):
        found["sign"] = parts["tone"].sign
    return found


def _cells(row: Mapping[str, Any], columns: Mapping[str, TableColumn]) -> Iterator[dict[str, Any]]:
    """Convert a row of a table to texts and judgements as the templates print them, with a dict for each cell."""
    for key, column in columns.items():
        value, ci95, badge, tone, note = (row.get(f"{key}{of}") for of in OF_VALUE)
        cell = {"text": mask_controls(cell_text(value, ci95, column.format)), "number": not isinstance(value, str)}
        sign = Tone(tone).sign if tone else ""
        yield cell | {"badge": badge, "tone": tone, "sign": sign, "note": mask_controls(note or "")}


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
    return Markup(f"data:{kind};charset=utf-8,{quote(content, safe=UNESCAPED)}")


def require_typst() -> Any:
    """Import typst, or raise an error with the command that installs it."""
    return import_library("typst", "writing the report as PDF (omitted with --no-pdf)")


def render_pdf(report: Report, folder: Path) -> bytes:
    """Typeset a report, whose pictures are in ``folder/figures``, as a PDF; equal reports of one day are typeset once.

    Text is passed as JSON data, so that nothing in it can be executed. Raises `ConfigurationError` if typst is missing,
    and typst's own error, a sign of a bug in srbval, if the document does not compile.
    """
    typst, template, text = require_typst(), _template("report.typ"), json.dumps(_displayable(as_plain(report)))
    pictures = [(one.name, one.read_bytes()) for one in sorted((folder / FIGURES_FOLDER).glob("*.svg"))]
    key = content_sha256(template, text, pictures, version_of("typst"), version_of("matplotlib"))
    if (stored := PDF_STORE.load(key, base64.b64decode)) is not None:
        return stored
    content: bytes = typst.compile(
        template.encode("utf-8"),
        root=str(folder),
        format="pdf",
        font_paths=[str(_font()[0])],
        ignore_system_fonts=True,
        sys_inputs={"report": text},
        pdf_standards=["ua-1"],
    )
    PDF_STORE.save(key, base64.b64encode(content).decode())
    return content


@lru_cache(maxsize=1)
def _font() -> tuple[Path, frozenset[int]]:
    """Return the folder of the PDF's font and the code points that it can display; PDF/UA forbids missing glyphs."""
    from matplotlib import ft2font, get_data_path

    folder = Path(get_data_path()) / "fonts" / "ttf"
    return folder, frozenset(ft2font.FT2Font(str(folder / "DejaVuSans.ttf")).get_charmap())


def _displayable(value: Any) -> Any:
    """Replace characters that the PDF's font lacks in all strings, and allow line breaks inside long words."""
    if isinstance(value, dict):
        return {key: item if key in ("file", "kind") else _displayable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_displayable(item) for item in value]
    if not isinstance(value, str):
        return value
    _, known = _font()
    shown = "".join(c if c in "\n\t" or ord(c) in known else "\ufffd" for c in value)
    parts = re.sub(LONG_WORD, lambda word: _SEPARATOR.sub("\u200b", word[0]), shown)
    return re.sub(rf"\S{{{MAX_WORD}}}(?=\S)", lambda match: match[0] + "\u200b", parts)


def write_report(report: Report, folder: Path, formats: Collection[str] = FORMATS) -> dict[str, Path]:
    """Write ``report.html``, ``report.pdf``, ``report.json`` and ``figures/`` into `folder`; return their paths.

    ``figures`` contains the pictures and, as CSV, their data and the report's tables. If writing fails, the former
    files remain. ``report.json`` lists all files with their SHA-256; unchanged files of a former report that are no
    longer listed are removed. For `formats` see `check_formats`. Raises `DataError` if `folder` cannot be written to.
    """
    try:
        existing = next(path for path in (folder.resolve(), *folder.resolve().parents) if path.is_dir())
        # on the file system of the folder, so that moving is atomic
        with tempfile.TemporaryDirectory(prefix=".srbval-report-", dir=existing) as name:
            stage = Path(name)
            draw_figures(report, stage)
            for table in report.tables():
                write_csv(table, stage / FIGURES_FOLDER)
            if "html" in formats:
                (stage / "report.html").write_text(render_html(report, stage), encoding="utf-8")
            if "pdf" in formats:
                (stage / "report.pdf").write_bytes(render_pdf(report, stage))
            data = {**report.data, "tables": report.tables(), "figures": report.figures()}
            move_listed_files(stage, folder, "report.json", data if "json" in formats else None)
    except OSError as error:
        raise DataError(
            f"the report could not be written to {folder}: {error.strerror or error} "
            f"({error.filename or folder}). Choose another folder or free some space."
        ) from error
    return {kind: folder / f"report.{kind}" for kind in formats}


def check_formats(formats: Collection[str]) -> None:
    """Raise `ConfigurationError` for an unknown format, or for ``pdf`` without typst."""
    if unknown := [kind for kind in formats if kind not in FORMATS]:
        raise ConfigurationError(f"report format {unknown[0]!r} is not known; choose from {', '.join(FORMATS)}.")
    if "pdf" in formats:
        require_typst()


def draw_figures(report: Report, folder: Path) -> None:
    """Draw the figures of a report into ``folder/figures``, many new ones in several processes."""
    panels = [figure.draw for figure in report.figures() if isinstance(figure.draw, Panel)]
    new = [panel for panel in panels if not panel.is_stored()]
    jobs = min(usable_cores(), len(new) // FIGURES_PER_PROCESS)
    drawn = dict(in_processes(Panel.files, new, jobs=jobs)) if jobs > 1 else {}
    for figure in report.figures():
        draw = partial(write_files, drawn[figure.draw]) if figure.draw in drawn else figure.draw
        draw(folder / FIGURES_FOLDER, figure.id)


def write_csv(table: ReportTable, folder: Path) -> None:
    """Write a table as CSV, unrounded; half widths of intervals become columns of their own."""
    titles: dict[str, str] = {}
    for place, (key, column) in enumerate(table.columns.items(), start=1):
        title = f"{column.title}, {column.unit}" if column.unit else column.title
        titles[key] = f"{title} ({place})" if title in titles.values() else title
        if any(f"{key}_ci95" in row for row in table.rows):
            titles[f"{key}_ci95"] = f"{titles[key]}, ±"
    frame = pd.DataFrame(to_json(table.rows), columns=list(titles))
    folder.mkdir(parents=True, exist_ok=True)
    text = frame.to_csv(index=False, header=list(titles.values()), lineterminator="\n")
    (folder / f"{table.id}.csv").write_text(text, encoding="utf-8", errors="backslashreplace")
