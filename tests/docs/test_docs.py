"""Documentation and README: every public name has an entry, every equation its code; examples and commands hold."""

import functools
import importlib.util
import json
import pkgutil
import re
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import pandas as pd
import pytest

import srbval
from srbval.recordings.datasets.description import DatasetDescription
from srbval.recordings.loaders import FILE_FORMATS
from srbval.storage.tables import build, read_toml
from tests.test_layers import MODULES, ORDER

PACKAGE = Path(srbval.__file__).parent
ROOT = PACKAGE.parent
DOCS = PACKAGE / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
THEORY = [path for path in PAGES if path.parent.name == "theory" and path.stem != "index"]
INSERTED = re.compile(r"\{\{(.*?)\}\}")
ELSEWHERE = re.compile(r"```.*?```|`[^`]*`|\$[^$]*\$|\]\([^)]*\)", re.DOTALL)  # code, formulas, addresses
UNITS = r"%|°|dB|[kM]?Hz|k?N\b|[kµmn]?m\b|k?W\b|[mµ]?s\b|kg|rpm|times|of \d+"
NUMBER = re.compile(rf"(?:\d[\d.,]*(?: to | and |–))?\d[\d.,]*[ \u00a0]?(?:{UNITS})|\d+\.\d+")
TYPED = (  # settings, limits, bands, the numbers of the paper and of other authors, versions: srbval measured none
    "0.01 | 0.05 | 0.1 % | 0.12 | 0.4 | 0.5 | 0.5 % | 0.5 mm | 0.52 | 0.62 | 0.95 | 0.96 | 0.985 | 1 kHz | 1 rpm | "
    "1.2 | 1.5 | 1.5 % | 10 % | 10 s | 10.3390 | 100 % | 10° | 12 kHz | 1400 to 2800 Hz | 1400–2800 Hz | 141.81 mm | "
    "15.2 kg | 2 dB | 2.2 | 2.5 to 25 µs | 20 dB | 200 ms | 3 dB | 3.06 | 3.11 | 3.13 | 3.14 | 3150 Hz | 353 rpm | "
    "4 dB | 4.2 | 40.1 mm | 400 to 3150 Hz | 45° | 5 % | 5 MHz | 500 Hz | 500 to 1500 Hz | 500–1500 Hz | 60 Hz | "
    "60 ° | 61440 s | 7.3 | 877 rpm | 877 to 353 rpm | 95 % | 95 of 100"
)
EQUATION = re.compile(r"```\{math\}\n(?::\w+:.*\n)*")
CODE = re.compile(r"\{py:obj\}`([\w.]+)`")


@functools.cache
def conf() -> ModuleType:
    spec = importlib.util.spec_from_file_location("srbval_docs_conf", DOCS / "conf.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_module_is_in_the_reference():
    listed = {name for room in ORDER for name in conf().modules_of(room)}
    assert MODULES - listed == {"srbval", "srbval.__main__", "srbval.docs.conf"}
    for room in ORDER:
        assert "MODULES" in (DOCS / "api" / f"{room}.md").read_text(encoding="utf-8"), room


def test_every_equation_has_its_own_label_and_a_code():
    labels = []
    for page in THEORY:
        text = page.read_text(encoding="utf-8")
        labels += re.findall(r":label: (\S+)", text)
        assert EQUATION.search(text), page.name
        for block in EQUATION.finditer(text):
            section = text[block.start() : text.find("\n## ", block.start()) % (len(text) + 1)]
            assert ":label:" in block[0], f"{page.name}: no label on {section[:99]}"
            assert re.search(r"^Code:", section, flags=re.MULTILINE), f"{page.name}: no code below {section[:99]}"
    assert len(labels) == len(set(labels))
    used = {name for page in PAGES for name in re.findall(r"\{eq\}`([\w-]+)`", page.read_text(encoding="utf-8"))}
    assert used <= set(labels)


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(DOCS)))
def test_every_code_that_is_named_is_there_and_every_formula_needs_no_network(page):
    """The pages contain MathML by docutils, which supports less of TeX than a browser's script."""
    text = page.read_text(encoding="utf-8")
    assert all(pkgutil.resolve_name(dotted) is not None for dotted in CODE.findall(text))
    mathml = pytest.importorskip("docutils.utils.math.latex2mathml")
    for block in re.findall(r"```\{math\}\n(?::\w+:[^\n]*\n)*(.*?)```", text, flags=re.DOTALL):
        assert mathml.tex2mathml(block.strip(), as_block=True).startswith("<math")
    for formula in re.findall(r"\$([^$]+)\$", re.sub(r"```.*?```|`[^`]*`", "", text, flags=re.DOTALL)):
        assert mathml.tex2mathml(formula.strip()).startswith("<math")


@pytest.mark.parametrize("page", [path for path in PAGES if path.parent.name in ("theory", "guide", "docs")])
def test_no_measured_number_is_typed(page):
    """A number with a unit or decimals is inserted from a result, scene or constant that exists, or is listed above."""
    jinja2 = pytest.importorskip("jinja2")
    environment = jinja2.Environment(undefined=jinja2.StrictUndefined)
    text = ELSEWHERE.sub(" ", page.read_text(encoding="utf-8"))
    for inserted in INSERTED.findall(text):
        assert environment.from_string(f"{{{{{inserted}}}}}").render(conf().myst_substitutions), inserted
    assert set(NUMBER.findall(INSERTED.sub(" ", text))) <= set(TYPED.split(" | "))


def test_every_option_and_every_scene_key_is_in_the_reference():
    assert ":ref: srbval.cli.arguments.build_parser" in (DOCS / "api" / "commands.md").read_text(encoding="utf-8")
    keys = conf().scene_keys()
    for row in (
        "| `radial` | force in N, kN, MN |",
        "| `load` | table [Load](#load) |",
        "| `path` | housing, bearing |",
    ):
        assert row in keys


@pytest.mark.parametrize(
    ("page", "pictures"), [("tutorial", 1), pytest.param("gallery", 10, marks=pytest.mark.long_form)]
)
def test_commands_and_examples_draw_the_pictures_of_their_page_when_it_is_made(page, pictures):
    """The short form leaves the gallery to the build of the pages, which fails if a picture does."""
    source = [(DOCS / "guide" / f"{page}.md").read_text(encoding="utf-8")]
    assert source[0].count("\nPICTURE ") == pictures
    conf().fill_in(None, f"guide/{page}", source)
    assert "\nPICTURE" not in source[0]
    assert len(set(re.findall(r'<img alt="[^"]{40,}" src="data:image/png;base64,([^"]+)"', source[0]))) == pictures


PAGE = (DOCS / "contributing.md").read_text(encoding="utf-8")
BLOCKS = [
    (title, kind, text)
    for title, section in re.findall(r"^### (.*?)\n(.*?)(?=^##|\Z)", PAGE, flags=re.MULTILINE | re.DOTALL)
    for kind, text in re.findall(r"^```(python|toml)\n(.*?)^```", section, flags=re.MULTILINE | re.DOTALL)
]
ORDER_CONDITION = 1e-15  # rounding of sums of a tableau's fractions


def example(title: str) -> dict[str, Any]:
    """Run the code of an example and return the names that it defines."""
    space: dict[str, Any] = {"__name__": "example"}
    (text,) = (text for known, kind, text in BLOCKS if (known, kind) == (title, "python"))
    exec(compile(text, title, "exec", dont_inherit=True), space)
    return space


@pytest.mark.parametrize("title", [title for title, kind, _ in BLOCKS if kind == "python"])
def test_code_runs(title):
    assert example(title)


def test_the_tableau_is_of_its_order():
    """Weights and squares of the stages' times: the order conditions of the quadrature."""
    method = example("A tableau")["RK38"]
    for power in range(4):
        assert method.b @ method.c**power == pytest.approx(1 / (power + 1), abs=ORDER_CONDITION)


def test_the_data_set_is_a_description(tmp_path):
    path = tmp_path / "example.toml"
    path.write_text(next(text for title, _, text in BLOCKS if title == "A data set"), encoding="utf-8")
    assert build(DatasetDescription, read_toml(path), "example").name == "my-rig"


README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_every_file_that_is_named_is_there():
    named = re.findall(r"`((?:srbval|tests|data_manifest|reports)/[\w/.]+)`", PAGE)
    for name in [*named, *re.findall(r"\]\(([\w/.]+)\)", README)]:
        assert (ROOT / name).exists(), name


def test_ci_runs_the_readmes_test_command():
    commands = [block for block in re.findall(r"```sh\n(.*?)\n```", README, flags=re.DOTALL) if "venv" in block]
    installation, tests = commands
    assert README.index(installation) < README.index("srbval analyse")
    assert ".venv/bin/pytest" in tests
    assert tests in (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()


def test_the_extra_for_formats_brings_what_they_need():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    in_formats = {re.split(r"[<>=]", library)[0] for library in extras["formats"]}
    assert {form.library[1] for form in FILE_FORMATS if form.library} - {"h5py", "pandas", "scipy"} == in_formats
    assert '".[pdf,formats]"' in README


def test_the_graded_benchmark_is_the_stored_one():
    """README states numbers that hold for the first and the latest run; the latest is wrong on N1 records alone."""
    stored = json.loads((ROOT / "reports" / "naming.json").read_text(encoding="utf-8"))
    columns = ["records", "right", "wrong", "public_right", "public_wrong"]
    tables = [pd.DataFrame(stored[run]["table"]).query("part == 'all'") for run in ("graded", "graded_later")]
    first, later = (table.set_index("grade")[columns] for table in tables)
    records, right, wrong, *public = first.loc[["Y1", "Y2"]].sum().tolist()
    assert later.loc[["Y1", "Y2"]].sum().tolist() == [records, right, wrong, *public]
    assert later.drop("N1").equals(first.drop("N1")), "the guide names only N1 records"
    ours = f"For the {records} diagnosable recordings (grades Y1 and Y2), srbval names {right} faults correctly"
    theirs = f"a public diagnosis program {public[0]} correctly and {public[1]} wrongly"
    assert f"{ours} and {wrong} wrongly, {theirs}" in " ".join(README.split())
