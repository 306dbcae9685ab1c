"""Files of a small report: all or none; a page without further files that escapes everything; a tagged PDF."""

import base64
import hashlib
import json
import re
import sys
import zlib
from collections import Counter
from dataclasses import replace
from importlib import resources
from types import SimpleNamespace

import pytest

from srbval.errors import ConfigurationError, DataError
from srbval.report import renderers
from srbval.report.renderers import check_formats, render_pdf, write_report


def listing(folder):
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*"))


@pytest.fixture(scope="module")
def files(report, tmp_path_factory):
    pytest.importorskip("typst")
    return write_report(report, tmp_path_factory.mktemp("made") / "deep" / "out")


def test_a_failure_leaves_what_was_there(report, tmp_path, monkeypatch):
    folder = tmp_path / "out"
    write_report(report, folder, ("json",))
    before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}

    def fail(*_):
        raise RuntimeError("out of luck")

    monkeypatch.setattr(renderers, "move_listed_files", fail)
    with pytest.raises(RuntimeError):
        write_report(report, folder, ("html", "json"))
    assert {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()} == before
    assert listing(tmp_path) == ["out", *(f"out/{name}" for name in listing(folder))]


def test_a_new_report_replaces_the_former_one_and_nothing_else(report, tmp_path):
    """Figures and tables that it has no more go; what someone else wrote or changed stays."""
    folder = tmp_path / "out"
    write_report(report, folder, ("html", "json"))
    own = {"notes.txt": "mine", "figures/mine.svg": "mine", "figures/fig11b.svg": "mine now", "appendix.pdf": "mine"}
    for name, text in own.items():
        (folder / name).write_text(text)
    listed = json.loads((folder / "report.json").read_text("utf-8"))["files"]
    answer, *pictures = ({f"figures/{name}.{end}" for end in ("csv", "svg")} for name in ("answer", "fig11b", "fig12a"))
    assert set(listed) == {"report.html", "figures/table6.csv"}.union(answer, *pictures)
    hostile = {"files": listed | {"../beside.txt": hashlib.sha256(b"mine").hexdigest()}}
    (tmp_path / "beside.txt").write_text("mine")
    (folder / "report.json").write_text(json.dumps(hostile))
    write_report(replace(report, sections=report.sections[:2]), folder, ("json",))
    kept = sorted(["figures", "figures/table6.csv", "report.json", *answer, *own])
    assert listing(tmp_path) == ["beside.txt", "out", *(f"out/{f}" for f in kept)]
    assert {name: (folder / name).read_text() for name in own} == own


def test_a_report_is_typeset_again_only_if_what_it_shows_has_changed(report, tmp_path, monkeypatch):
    pytest.importorskip("typst")
    typeset, typst = [], renderers.require_typst()
    compiled = SimpleNamespace(compile=lambda *given, **how: typeset.append(given) or typst.compile(*given, **how))
    monkeypatch.setattr(renderers, "require_typst", lambda: compiled)

    def written(**changed):
        return {kind: path.read_bytes() for kind, path in write_report(replace(report, **changed), tmp_path).items()}

    first = written()
    assert (written(), len(typeset)) == (first, 1)
    other = written(data={"new": 1.0})
    assert (other["pdf"], len(typeset)) == (first["pdf"], 1)
    assert other["json"] != first["json"]
    assert written(title="Another")["pdf"] != first["pdf"]


def test_what_cannot_be_written_is_refused(report, tmp_path):
    with pytest.raises(ConfigurationError, match="'docx' is not known"):
        check_formats(("html", "docx"))
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(DataError, match="could not be written"):
        write_report(report, tmp_path / "file" / "out", ("json",))


def test_nothing_outside_the_page_is_asked_for_and_no_other_script_may_run(files):
    """A browser blocks all else; `test_report_browser` sees that it has nothing to block."""
    html = files["html"].read_text("utf-8")
    (found,) = re.findall(r"<script>(.*?)</script>", html, re.DOTALL)
    assert found == (resources.files("srbval.report") / "templates" / "report.js").read_text("utf-8")
    (policy,) = re.findall(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)"', html)
    digest = base64.b64encode(hashlib.sha256(found.encode()).digest()).decode()
    assert policy == f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    text = re.sub(r"<[^>]*>", "", html)
    for words in ("✓ within", "✗ outside", "synthetic stand-in"):  # not told by colours alone
        assert words in text


def unpacked(content):
    """All bytes of the file with its compressed streams opened."""
    opened = [content]
    for stream in re.findall(rb"stream\r?\n(.*?)\r?\nendstream", content, re.DOTALL):
        try:
            opened.append(zlib.decompress(stream))
        except zlib.error:
            continue
    return b"\n".join(opened)


def test_the_pdf_is_tagged_and_its_tags_say_what_each_part_is(files, report):
    """PDF/UA-1 by our own reading of the structure tree: what each block is."""
    content = unpacked(files["pdf"].read_bytes())
    marks = (rb"/MarkInfo\s*<<\s*/Marked true", rb"/StructTreeRoot", rb"/Lang\s*\(en", rb"pdfuaid:part\W*1")
    for words in (*marks, rb"/DisplayDocTitle true", rb"Model against rig"):
        assert re.search(words, content)
    tags = Counter(tag.decode() for tag in re.findall(rb"/S\s*/([A-Z]\w*)\s*/P ", content))
    tables, figures = list(report.tables()), list(report.figures())
    assert tags["Document"] == tags["Title"] == 1
    assert {tag for tag in tags if re.fullmatch(r"H\d", tag)} == {"H1"}, "no level is left out"
    assert tags["H1"] == 1 + len(report.sections)
    assert tags["Figure"] == len(figures)
    assert tags["Caption"] == len(figures) + len(tables)
    assert tags["Table"] == len(tables)
    assert tags["TH"] == content.count(b"/Scope/Column") == sum(len(table.columns) for table in tables)
    assert tags["LI"] == tags["LBody"] > 0
    assert content.count(b"/Tabs/S") == content.count(b"/Type/Page/")
    for figure in figures:
        assert b"/Alt(" + figure.alt.replace("'", "\\'").encode() in content or figure.alt.encode() in content


def test_without_typst_the_error_says_what_to_install(report, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "typst", None)
    with pytest.raises(ConfigurationError, match=r"python\S* -m pip install typst\b"):
        render_pdf(report, tmp_path)
