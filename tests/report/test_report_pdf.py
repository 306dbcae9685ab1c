"""The PDF is tagged, complete, and the same each time."""

import builtins
import re
import zlib
from collections import Counter

import pytest

from srbval.errors import ConfigurationError
from srbval.report.renderers import render_pdf
from srbval.report.write import write_report

pytest.importorskip("typst")


@pytest.fixture(scope="module")
def pdf(report, tmp_path_factory):
    return write_report(report, tmp_path_factory.mktemp("pdf"), ("pdf",))["pdf"]


def unpacked(content):
    """All bytes of the file with its compressed streams opened."""
    streams = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", content, re.DOTALL)
    opened = [content]
    for stream in streams:
        try:
            opened.append(zlib.decompress(stream))
        except zlib.error:
            continue
    return b"\n".join(opened)


def test_it_is_a_tagged_pdf_ua_document_in_english(pdf):
    content = unpacked(pdf.read_bytes())
    assert re.search(rb"/MarkInfo\s*<<\s*/Marked true", content)
    assert b"/StructTreeRoot" in content
    assert re.search(rb"/Lang\s*\(en", content)
    assert re.search(rb"pdfuaid:part\W*1", content)
    assert b"Model against rig" in content


def test_each_picture_has_its_alt_text(pdf, report):
    content = unpacked(pdf.read_bytes())
    for figure in report.figures():
        alt = figure.alt.replace("'", "\\'").encode()
        assert b"/Alt(" + alt in content or b"/Alt(" + figure.alt.encode() in content


def test_its_tags_say_what_each_part_is(pdf, report):
    """PDF/UA-1 by our own reading of the structure tree: what each block is."""
    content = unpacked(pdf.read_bytes())
    tags = Counter(tag.decode() for tag in re.findall(rb"/S\s*/([A-Z]\w*)\s*/P ", content))
    tables, figures = list(report.tables()), list(report.figures())
    assert tags["Document"] == tags["Title"] == 1
    assert {tag for tag in tags if re.fullmatch(r"H\d", tag)} == {"H1"}, "no level is left out"
    assert tags["H1"] == 1 + len(report.sections)
    assert tags["Figure"] == len(figures)
    assert tags["Caption"] == len(figures) + len(tables)
    assert tags["Table"] == len(tables) + 1, "pairs of keys and values are a table too"
    assert tags["TH"] == content.count(b"/Scope/Column") == sum(len(table.columns) for table in tables)
    assert tags["LI"] == tags["LBody"] > 0
    assert b"/DisplayDocTitle true" in content
    assert content.count(b"/Tabs/S") == content.count(b"/Type/Page/")


def test_the_same_report_gives_the_same_bytes(pdf, report, tmp_path):
    again = write_report(report, tmp_path, ("pdf",))["pdf"]
    assert again.read_bytes() == pdf.read_bytes()


def test_without_typst_the_error_says_what_to_install(report, tmp_path, monkeypatch):
    real = builtins.__import__

    def without_typst(name, *args, **kwargs):
        if name == "typst":
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without_typst)
    with pytest.raises(ConfigurationError, match=r'pip install "srbval\[pdf\]"'):
        render_pdf(report, tmp_path)
