"""How Sphinx builds the documentation: ``sphinx-build -W -q srbval/docs FOLDER``.

A page ``api/ROOM.md`` says what a room of the package is for; the reference of its modules is put in at the word
`MODULES`, from the docstrings, so that none can be forgotten. `NAMES` stands for what the package itself offers.
"""

import re
from pathlib import Path
from typing import Any

import srbval

project = "srbval"
version = release = srbval.__version__
project_copyright = "2025-2026, the srbval authors"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode"]
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 3
html_theme = "alabaster"
html_theme_options = {"description": "simulated against measured bearing vibration", "page_width": "1100px"}
html_sidebars = {"**": ["about.html", "searchfield.html", "navigation.html"]}
html_show_sourcelink = False
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_default_options = {"members": True}
autodoc_preserve_defaults = True
default_role = "code"  # a name in single backquotes, as the docstrings write it
exclude_patterns = ["__pycache__"]

PACKAGE = Path(srbval.__file__).parent
MODULES, NAMES = "MODULES", "NAMES"
LITERAL = re.compile(r"(``.*?``)")


def modules_of(room: str) -> list[str]:
    """Dotted names of a room's modules, packages before what is in them; a room may be a single module."""
    place = PACKAGE / room
    if not place.is_dir():
        return [f"srbval.{room}"]
    files = [path.relative_to(PACKAGE.parent) for path in place.rglob("*.py")]
    return sorted(".".join(path.with_suffix("").parts).removesuffix(".__init__") for path in files)


def reference(room: str) -> str:
    """The reference of a room's modules. Names that a package gathers are documented where they are defined."""
    entries = []
    for name in modules_of(room):
        members = "   :ignore-module-all:\n" if (PACKAGE.parent / Path(*name.split("."))).is_dir() else ""
        entries.append(f"## `{name}`\n\n```{{eval-rst}}\n.. automodule:: {name}\n{members}```\n")
    return "\n".join(entries)


def offered() -> str:
    """A list of what the package offers, each name with its first sentence and a link."""
    rows = []
    for name in srbval.__all__:
        thing = getattr(srbval, name)
        if not hasattr(thing, "__module__"):
            continue
        first = (thing.__doc__ or "").strip().split("\n\n")[0].replace("\n", " ").replace("|", "\\|")
        rows.append(f"| {{py:obj}}`srbval.{name} <{thing.__module__}.{thing.__qualname__}>` | {first} |")
    return "\n".join(["| name | |", "| --- | --- |", *rows])


def fill_in(_app: Any, page: str, source: list[str]) -> None:
    """Put the reference into its pages."""
    if page.startswith("api/"):
        room = page.removeprefix("api/")
        source[0] = source[0].replace(MODULES, reference(room) if MODULES in source[0] else "")
        source[0] = source[0].replace(NAMES, offered() if NAMES in source[0] else "")


def bars_are_text(_app: Any, _what: str, _name: str, _thing: Any, _options: Any, lines: list[str]) -> None:
    """In docstrings a bar stands for a modulus, never for a substitution."""
    for i, line in enumerate(lines):
        parts = LITERAL.split(line)
        lines[i] = "".join(part if part.startswith("``") else part.replace("|", r"\|") for part in parts)


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("source-read", fill_in)
    app.connect("autodoc-process-docstring", bars_are_text)
