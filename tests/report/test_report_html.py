"""The page stands alone, escapes everything, and can be read without eyes or colours."""

import base64
import hashlib
import re
from html.parser import HTMLParser
from importlib import resources

import pytest

from srbval.report.blocks import Document
from srbval.report.renderers import render_html
from srbval.report.write import draw_figures

VOID = {"meta", "link", "img", "br", "hr", "input"}


class Page(HTMLParser):
    """Collects elements, checks that they nest, and keeps the text."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.open, self.text = [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        names = [name for name, _ in attrs]
        assert len(names) == len(set(names)), tag
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not {"style", "script"} & set(self.open):
            self.text.append(data)

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture(scope="module")
def html(report, tmp_path_factory):
    folder = tmp_path_factory.mktemp("drawn")
    draw_figures(report, folder, Document)
    return render_html(report, folder)


@pytest.fixture(scope="module")
def page(html):
    return Page(html)


def test_nothing_outside_the_file_is_asked_for(html, page):
    style = re.search(r"<style>(.*?)</style>", html, re.DOTALL).group(1)
    assert "url(" not in style
    assert "@import" not in style
    for tag, attributes in page.elements:
        for name in ("src", "href", "srcset", "action"):
            value = attributes.get(name) or "#"
            assert value.startswith(("#", "data:")), tag


def test_the_one_script_is_ours_and_no_other_may_run(html, page):
    (found,) = re.findall(r"<script>(.*?)</script>", html, re.DOTALL)
    assert found == (resources.files("srbval.report") / "templates" / "report.js").read_text("utf-8")
    (policy,) = [m["content"] for m in page.all("meta") if m.get("http-equiv") == "Content-Security-Policy"]
    digest = base64.b64encode(hashlib.sha256(found.encode()).digest()).decode()
    assert policy == f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'"
    assert not any(name.startswith("on") for _, attributes in page.elements for name in attributes)


def test_every_picture_has_an_alt_text_and_a_caption(page, report):
    assert [image["alt"] for image in page.all("img")] == [figure.alt for figure in report.figures()]
    assert len(page.all("figcaption")) == len(page.all("img"))


def test_hostile_text_is_text(html, page):
    assert html.count("<script>") == 1
    text = "".join(page.text)
    assert text.count('<script>alert(1)</script> "q" \'s\' #panic("x") $x$ *a* _b_ `c` @ref ../../etc') >= 4
    assert "A" * 10_000 in text
    assert "\x00" not in html


def test_landmarks_headings_and_scopes(page):
    assert page.all("html")[0]["lang"] == "en"
    for landmark in ("header", "main", "nav", "footer", "h1", "title"):
        assert len(page.all(landmark)) == 1 + (landmark == "header") * 0
    assert {a.get("scope") for a in page.all("th")} == {"col", "row"}
    assert len(page.all("caption")) == len(page.all("table"))


def test_every_anchor_and_label_leads_somewhere(page):
    ids = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    wanted = [a["href"][1:] for a in page.all("a") if a["href"].startswith("#")]
    wanted += [a["aria-labelledby"] for _, a in page.elements if "aria-labelledby" in a]
    assert set(wanted) <= set(ids)


def test_a_verdict_shows_in_words_and_signs_and_a_stand_in_says_so(page):
    text = " ".join("".join(page.text).split())
    assert "✓ within" in text
    assert "✗ outside" in text
    assert "synthetic stand-in Figure 11b." in text


def test_dark_and_print_styles_are_there(html):
    assert "@media (prefers-color-scheme: dark)" in html
    assert "@media print" in html
