"""The report as one HTML file: no network, pictures and data inside, whole without its one small script."""

import base64
import hashlib
import re
from functools import partial
from importlib import resources
from pathlib import Path
from urllib.parse import quote

from markupsafe import Markup

from srbval.report.model import Document, Report
from srbval.report.plain import as_plain

# What a data URI may hold as it stands, besides letters and digits: as much as the quoted attribute allows.
_PLAIN = " !$'()*+,-./:;=?@[]^_{|}~"
_MEDIA_TYPES = {".svg": "image/svg+xml", ".png": "image/png", ".csv": "text/csv"}


def render_html(
    report: Report, folder: Path, document: Document = Document.MAIN, *, with_appendix: bool = False
) -> str:
    """Render one document as a whole page, with links to the other one where both are made (`with_appendix`).

    Its pictures and their data already lie in ``folder/figures``. All text is escaped by the template engine; pictures
    and data become data URIs. Raises FileNotFoundError when a file of a figure is missing.
    """
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    environment = Environment(
        loader=FunctionLoader(_template_text), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    script = _template_text("report.js")
    return environment.get_template("report.html.j2").render(
        report=as_plain(report, document, with_appendix=with_appendix),
        style=_template_text("report.css"),
        script=script,
        script_hash=base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii"),
        carried=partial(_data_uri, folder),
    )


def _template_text(name: str) -> str:
    return (resources.files("srbval.report") / "templates" / name).read_text(encoding="utf-8")


def _data_uri(folder: Path, name: str) -> Markup:
    """A file as a data URI without any sign that HTML would have to escape in an attribute between double quotes.

    Text is percent-encoded, which is smaller than base64; pictures of pixels are in base64.
    """
    path = folder / name
    kind, content = _MEDIA_TYPES[path.suffix], path.read_bytes()
    if kind == "image/png":
        return Markup(f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}")
    if kind == "image/svg+xml":
        content = re.sub(rb">\s*\n\s*<", b"><", content)
        content = content if b"'" in content else content.replace(b'"', b"'")
    return Markup(f"data:{kind};charset=utf-8,{quote(content, safe=_PLAIN)}")
