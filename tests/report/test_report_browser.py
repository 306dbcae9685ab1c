"""The page in a browser: no accessibility violation, no request, no error, nothing cut, and its script's zoom works.

Chromium is driven through Playwright: one on the PATH, one named by SRBVAL_CHROMIUM, or the one that
`playwright install chromium` brings; without any these tests skip.
"""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Self

import pytest

from .made import Made

LOOKS = ((360, "dark"), (1400, "light"))  # narrowest and widest window, each in one of the two colour schemes
PAGES = (("hostile", "html"), ("with_rig", "appendix_html"))  # every kind of block
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
# Elements that reach beyond the window and are not inside something that scrolls, and text that its box cuts.
CUT = """() => {
  const scrolls = (node) => { for (; node; node = node.parentElement) {
    if (['auto', 'scroll'].includes(getComputedStyle(node).overflowX)) return true; } return false; };
  const width = document.documentElement.clientWidth, found = [];
  if (document.documentElement.scrollWidth > width) found.push('page ' + document.documentElement.scrollWidth);
  for (const node of document.querySelectorAll('body *')) {
    if (node.closest('svg') && node.tagName !== 'svg') continue;
    const box = node.getBoundingClientRect();
    if (box.width && (box.right > width + 1 || box.left < -1) && !scrolls(node) && !node.classList.contains('skip'))
      found.push(`beyond: ${node.tagName} ${node.className} ${node.id}`);
    const style = getComputedStyle(node);
    if (['hidden', 'clip'].includes(style.overflowX) && node.scrollWidth > node.clientWidth + 1)
      found.push(`cut: ${node.tagName} ${node.className}`);
  }
  return found.slice(0, 5);
}"""
BROKEN = "() => [...document.images].filter((i) => !i.complete || !i.naturalWidth).map((i) => i.alt)"


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        path = os.environ.get("SRBVAL_CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
        path = path or playwright.chromium.executable_path
        if not Path(path).exists():
            pytest.skip("no Chromium: name one by SRBVAL_CHROMIUM or run `playwright install chromium`")
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


class Visit:
    """A page opened, with what it asked for and complained of."""

    def __init__(self, browser: Any, file: Path, **options: Any) -> None:
        self.context = browser.new_context(**options)
        self.page = self.context.new_page()
        self.complaints: list[str] = []
        self.page.on("console", lambda m: self.complaints.append(f"{m.type}: {m.text[:200]}"))
        self.page.on("pageerror", lambda e: self.complaints.append(str(e)[:200]))
        self.page.on("dialog", lambda d: self.complaints.append(f"dialog: {d.message[:200]}"))
        self.page.on("request", self._note)
        self.own = file.as_uri()
        self.page.goto(self.own)

    def _note(self, request: Any) -> None:
        if request.url != self.own and not request.url.startswith("data:"):
            self.complaints.append(f"request: {request.url[:200]}")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.context.close()


def violations(page: Any) -> list[str]:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    found = axe.run(page).response["violations"]
    return [f"{v['id']}: {v['help']}: {v['nodes'][0]['html'][:200]} ({len(v['nodes'])})" for v in found]


@pytest.mark.parametrize(("report", "document"), PAGES)
def test_nothing_is_cut_asked_for_complained_of_or_inaccessible(
    chromium: Any, request: pytest.FixtureRequest, report: str, document: str
) -> None:
    """Wide and narrow, light and dark, before and after every chart is opened for zooming."""
    made: Made = request.getfixturevalue(report)
    with Visit(chromium, made.files[document]) as visit:
        for width, scheme in LOOKS:
            visit.page.set_viewport_size({"width": width, "height": 1000})
            visit.page.emulate_media(color_scheme=scheme)
            assert visit.page.evaluate(CUT) == [], width
            for button in visit.page.locator("button.open").all() if scheme == LOOKS[0][1] else ():
                button.click()
            assert visit.page.evaluate(CUT) == [], width
            assert violations(visit.page) == [], (width, scheme)
        assert visit.page.evaluate(BROKEN) == []
        assert visit.complaints == []


def test_the_answer_comes_before_the_contents(chromium: Any, hostile: Made) -> None:
    """On a telephone, and in the order in which the page is read aloud."""
    with Visit(chromium, hostile.files["html"], viewport={"width": 390, "height": 844}) as visit:
        tops = [visit.page.locator(what).bounding_box()["y"] for what in ("h1", "#verdict", "nav", "#records-section")]
        assert tops == sorted(tops)
        assert visit.page.evaluate(
            "document.querySelector('#verdict').compareDocumentPosition(document.querySelector('nav')) & 4"
        )


def test_without_scripts_everything_is_there(chromium: Any, hostile: Made) -> None:
    with Visit(chromium, hostile.files["html"], java_script_enabled=False) as visit:
        text = visit.page.locator("main").inner_text()
        assert "Figure 12a" in text
        assert "<script>alert(1)</script>" in text
        assert visit.page.locator("button").count() == 0
        assert visit.page.locator("a.data").first.get_attribute("href").startswith("data:text/csv")
        assert visit.complaints == []


def test_a_spectrum_can_be_zoomed_and_read_by_keyboard(chromium: Any, hostile: Made) -> None:
    with Visit(chromium, hostile.files["html"], viewport={"width": 1000, "height": 900}) as visit:
        page = visit.page
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.textContent") == "Skip to the report"
        page.locator("#fig12a button.open").press("Enter")
        plot = page.locator("#fig12a svg.plot")
        assert page.locator("#fig12a .plot text.mark").all_text_contents()[:2] == ["BPFO", "2xBPFO"]
        before = plot.locator("text").all_text_contents()
        plot.press("+")
        plot.press("ArrowRight")
        assert plot.locator("text").all_text_contents() != before
        said = page.locator("#fig12a .readout").inner_text()
        assert "Hz" in said
        assert "order" in said
        assert "healthy" in said
        plot.press("Escape")
        assert plot.locator("text").all_text_contents() == before


def test_the_pointer_zooms_and_reads(chromium: Any, hostile: Made) -> None:
    with Visit(chromium, hostile.files["html"], viewport={"width": 1000, "height": 900}) as visit:
        page = visit.page
        page.locator("#fig12a button.open").click()
        plot = page.locator("#fig12a svg.plot")
        plot.scroll_into_view_if_needed()
        box = plot.bounding_box()
        middle = box["y"] + box["height"] / 2
        page.mouse.move(box["x"] + 200, middle)
        assert "Hz from" in page.locator("#fig12a .readout").inner_text()
        page.mouse.down()
        page.mouse.move(box["x"] + 300, middle, steps=3)
        page.mouse.up()
        shown = [float(t) for t in plot.locator("text").all_text_contents() if t.replace(".", "").isdigit()]
        assert max(shown) < 400
        page.emulate_media(media="print")  # on paper there are no controls
        assert not page.locator("nav").is_visible()
        assert not page.locator("button.open").first.is_visible()
        assert page.locator("#fig12a img").is_visible()
