"""The page in a browser: no accessibility violation, no request, no error, nothing cut, and its script's zoom works.

Chromium is driven through Playwright: one on the PATH, one named by SRBVAL_CHROMIUM, or the one that
`playwright install chromium` brings; without any these tests skip.
"""

import json
import os
import shutil
from pathlib import Path
from typing import Any, Self

import numpy as np
import pytest

from srbval.cli import run_command_line
from srbval.report.renderers import write_report
from tests.reading.test_shaft_speed import FS_HZ, record

from .conftest import Made

LOOKS = ((360, "dark"), (1400, "light"))  # narrowest and widest window, each in one of the two colour schemes
DAYS = 6
OWN = {"file": ["report", "day5.npy"], "folder": ["report", "."], "trend": ["trend", ".", "--baseline", "5"]}
GIVEN = ["--fs", f"{FS_HZ:g}", "--rpm", "1500", "--unit", "m/s2", "--bearing", "skf-6205", "--band", "2000", "5000"]
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
def chromium():
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
    found = pytest.importorskip("axe_playwright_python.sync_playwright").Axe().run(page).response["violations"]
    return [f"{v['id']}: {v['help']}: {v['nodes'][0]['html'][:200]} ({len(v['nodes'])})" for v in found]


@pytest.fixture
def document(request, tmp_path, monkeypatch):
    """The page of this name; those of a user's files are written from six days of a machine and a broken file."""
    if request.param == "default":
        made: Made = request.getfixturevalue("with_rig")
        return made.files["html"]
    if request.param == "every block":
        return write_report(request.getfixturevalue("report"), tmp_path, ("html",))["html"]
    (tmp_path / "fan").mkdir()
    monkeypatch.chdir(tmp_path / "fan")
    if request.param == "case":
        for name, seed in (("sim_outer", 1), ("rig_outer", 2)):
            np.save(f"{name}.npy", record(shaft_hz=25.0, seed=seed).channels["x"])
        settings = [f"--set={side}.fs_hz={FS_HZ:g}" for side in ("simulated", "measured")]
        settings += [f"--set={key}" for key in ("measured.rpm=1500", "measured.unit=m/s2", "simulated.unit=m/s2")]
        files = ["--simulated", "sim_outer.npy", "--measured", "rig_outer.npy", "--rpm", "1500", "--no-pdf", "-o", ".."]
        command = ["validate", *files, "--bearing", "skf-6205", "--set=uncertainty.cage_pct=0.1", *settings]
        assert run_command_line(command) == 0
        return tmp_path / "report.html"
    for day in range(DAYS):
        np.save(f"day{day}.npy", record(shaft_hz=25.0, seed=day, fault=day == DAYS - 1).channels["x"])
    Path("broken.npy").write_bytes(b"")
    output = ["--plot", "../trend.html"] if request.param == "trend" else ["--no-pdf", "-o", ".."]
    assert run_command_line([*OWN[request.param], *GIVEN, *output]) == (0 if request.param == "file" else 3)
    return tmp_path / ("trend.html" if request.param == "trend" else "report.html")


@pytest.mark.parametrize("document", ["default", "every block", "case", *OWN], indirect=True)
def test_nothing_is_cut_asked_for_complained_of_or_inaccessible(chromium, document):
    """Wide and narrow, light and dark, before and after every chart is opened for zooming; the answer is the top."""
    with Visit(chromium, document) as visit:
        order = ("#verdict", "#verdict figure", "main section:not(#verdict)")
        tops = [visit.page.locator(what).first.bounding_box()["y"] for what in order]
        assert tops == sorted(tops)
        for width, scheme in LOOKS:
            visit.page.set_viewport_size({"width": width, "height": 1000})
            visit.page.emulate_media(color_scheme=scheme)
            assert visit.page.evaluate(CUT) == [], width
            for button in visit.page.locator("button.all, button.open").all() if scheme == LOOKS[0][1] else ():
                button.click()
            assert visit.page.evaluate(CUT) == [], width
            assert violations(visit.page) == [], (width, scheme)
        assert visit.page.evaluate(BROKEN) == []
        assert visit.complaints == []


def test_the_answer_is_the_first_screen_and_the_rest_is_folded(chromium, with_rig):
    """On a telephone and in the order in which the page is read aloud; a link opens what it leads to, paper all."""
    with Visit(chromium, with_rig.files["html"], viewport={"width": 390, "height": 844}) as visit:
        page = visit.page
        tops = [
            page.locator(what).bounding_box()["y"]
            for what in ("h1", "#verdict", "#table-6-sources", "#small-11c", "#table-6")
        ]
        assert tops == sorted(tops)
        assert not page.locator("nav").is_visible()  # on so narrow a page it would only repeat the folded titles
        assert page.locator("details.fold[open]").count() == 0
        page.goto(f"{visit.own}#fig12a")
        assert page.locator("#fig12a img").is_visible()
        assert page.locator("details.fold[open]").count() == 1
        page.locator("button.all").click()
        assert page.locator("details.fold:not([open])").count() == 0
        assert page.locator(".overflows").count() > 0, "what is wider than its place says so"


def shown(page: Any) -> list[float]:
    """Which part of the x axis Figure 12a shows."""
    return [float(end) for end in page.locator("#fig12a .explore").get_attribute("data-shown").split(",")]


def test_a_spectrum_can_be_zoomed_and_read_by_keyboard_and_pointer(chromium, with_rig):
    """The pointer on a line reads the line's name, where it is expected, and the highest value there."""
    with Visit(chromium, with_rig.files["html"], viewport={"width": 1000, "height": 900}) as visit:
        page = visit.page
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.textContent") == "Skip to the report"
        page.goto(f"{visit.own}#fig12a")
        page.locator("#fig12a button.open").press("Enter")
        plot = page.locator("#fig12a .plot")
        before = shown(page)
        plot.press("+")
        plot.press("ArrowRight")
        assert shown(page)[1] < before[1]
        said = page.locator("#fig12a .readout").inner_text()
        assert "Hz" in said
        assert "order" in said
        assert "healthy" in said
        plot.press("Escape")
        assert shown(page) == before
        plot = page.locator("#fig12a .u-over")
        plot.scroll_into_view_if_needed()
        box, (low, high) = plot.bounding_box(), before
        name, expected_hz = json.loads(page.locator("#fig12a").get_attribute("data-explore"))["marks"][0]
        middle, at = box["y"] + box["height"] / 2, box["x"] + box["width"] * (expected_hz - low) / (high - low)
        page.mouse.move(at, middle)
        assert page.locator("#fig12a .readout").inner_text().startswith(f"{name}, expected at {expected_hz:.6g} Hz")
        page.mouse.down()
        page.mouse.move(at + 100, middle, steps=3)
        page.mouse.up()
        assert shown(page)[0] == pytest.approx(expected_hz, abs=3)
        page.emulate_media(media="print")  # on paper there are no controls
        assert not page.locator("nav").is_visible()
        assert not page.locator("button.open").first.is_visible()
        assert page.locator("#fig12a img").is_visible()
