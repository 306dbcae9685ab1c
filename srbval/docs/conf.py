"""Configuration of Sphinx, which builds the documentation: ``sphinx-build -W -q srbval/docs FOLDER``.

A page ``api/NAME.md`` describes the subpackage `NAME`. Its line `MODULES` becomes the reference of the subpackage's
modules, made from their docstrings. On other pages in ``api``, a line `NAMES` becomes a list of the package's public
names, `SCENE_KEYS` a list of the keys of a scene file. A page ``notebooks/NAME.md`` contains the stored notebook `NAME`
with its output. An expression such as `{{ amplitudes.counts.locked.of }}` becomes a number of a stored result, see
`stored_numbers`. A line `PICTURE alt text` on a page in ``guide`` becomes the picture that the preceding command or
Python example draws from the shipped recordings. Formulas become MathML, which browsers display without a network.
"""

import base64
import contextlib
import importlib
import io
import json
import os
import re
import shlex
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import srbval
from srbval.cli import run_command_line
from srbval.scene import scene_table
from srbval.storage.installation import shipped_folder
from srbval.storage.stored_result import newest_result

project = "srbval"
version = release = srbval.__version__
project_copyright = "2025-2026, the srbval authors"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode", "sphinxarg.ext"]
if {"GITHUB_ACTIONS", "READTHEDOCS"} & set(os.environ):  # elsewhere the pages are built without a network
    extensions.append("sphinx.ext.intersphinx")
intersphinx_mapping = {
    "matplotlib": ("https://matplotlib.org/stable", None),
    "numpy": ("https://numpy.org/doc/stable", None),
    "pandas": ("https://pandas.pydata.org/docs", None),
    "python": ("https://docs.python.org/3", None),
    "scipy": ("https://docs.scipy.org/doc/scipy", None),
    "xarray": ("https://docs.xarray.dev/en/stable", None),
}
myst_enable_extensions = ["dollarmath", "amsmath", "substitution"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = f"srbval {release}"
html_static_path = ["static"]
html_css_files = ["pages.css"]
html_show_sourcelink = False
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_default_options = {"members": True}
autodoc_preserve_defaults = True
autodoc_use_type_comments = False
smartquotes_action = "qe"  # leaves the dashes of options
default_role = "code"  # a name in single backquotes, as the docstrings write it

PACKAGE = Path(srbval.__file__).parent
html_math_renderer = "mathml"
DRAWN = re.compile(
    r"(?P<before>^```(?P<kind>sh|python)\n(?P<code>[^`]*?(?P<file>[\w-]+\.png)[^`]*?)```(?:(?!```(?:sh|python)).)*?)"
    r"^PICTURE (?P<alt>[^\n]+)$",
    re.DOTALL | re.M,
)
PICTURE = '<img alt="{}" src="data:image/png;base64,{}">'

STORED = "amplitudes", "model_levels", "naming", "reading", "scale"
CONSTANTS = (
    "diagnosis.baseline diagnosis.fault_posterior diagnosis.long_records models.estimates models.health "
    "models.step_error path.locked reading.families reading.pipeline signal.comb signal.false_alarm signal.slip"
)


def stored_numbers() -> dict[str, Any]:
    """Return numbers to insert into documentation pages: from stored results, bundled scenes and module constants."""
    numbers = {name: scene_table(name) for name in ("paper", "rig")}
    for name in STORED:
        result = newest_result(name)
        assert result, f"no stored result {name}: run srbval evidence {name}"
        numbers[name] = result.content
    for module in CONSTANTS.split():
        numbers[module.split(".")[1]] = {
            name: value
            for name, value in vars(importlib.import_module(f"srbval.{module}")).items()
            if name.isupper() and isinstance(value, dict | float | int | tuple)
        }
    naming = numbers["naming"]
    numbers["named"] = {row["name"]: row for row in naming["methods"] if row["by"] == "all"}
    runs = ("graded", "graded_later")  # the first of this benchmark and the latest
    return numbers | {run: {x["grade"]: x for x in naming[run]["table"] if x["part"] == "all"} for run in runs}


myst_substitutions = stored_numbers()


def modules_of(room: str) -> list[str]:
    """List dotted names of all modules of `room`, a subpackage or module of srbval, each package before its modules."""
    files = [p.relative_to(PACKAGE.parent) for p in (PACKAGE / room).rglob("*.py")] or [Path("srbval", f"{room}.py")]
    return sorted(".".join(path.with_suffix("").parts).removesuffix(".__init__") for path in files)


def reference(room: str) -> str:
    """Write the Sphinx directives that document all modules of the subpackage `room`."""
    entry = "## `{0}`\n\n```{{eval-rst}}\n.. automodule:: {0}\n```\n"
    return "\n".join(map(entry.format, modules_of(room)))


def offered() -> str:
    """List the package's public names, each with the first sentence of its docstring and a link."""
    rows = []
    for name in srbval.__all__:
        thing = getattr(srbval, name)
        if hasattr(thing, "__module__"):
            first = cell((thing.__doc__ or "").strip().split("\n\n")[0])
            rows.append((f"{{py:obj}}`srbval.{name} <{thing.__module__}.{thing.__qualname__}>`", first))
    return table(("name", ""), rows)


def fill_in(_app: Any, page: str, source: list[str]) -> None:
    """Insert generated parts into the `source` of a documentation page: reference, notebook, and examples' pictures."""
    folder, _, name = page.partition("/")
    if folder in ("api", "guide"):
        makers = {"NAMES": offered, "SCENE_KEYS": scene_keys, "MODULES": lambda: reference(name)}
        source[0] = "\n".join(makers[line]() if line in makers else line for line in source[0].split("\n"))
    if folder == "notebooks" and name != "index":
        source[0] = notebook(name)
    if folder == "guide":
        source[0] = DRAWN.sub(lambda found: found["before"] + drawn(**found.groupdict()), source[0])


def drawn(kind: str, code: str, file: str, alt: str, **_: str) -> str:
    """Run example code in a folder with the shipped recordings; return the picture `file` that it draws as HTML.

    `kind` is the code's language (python or sh), `alt` the alternative text of the picture.
    """
    import matplotlib

    matplotlib.use("agg")
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), contextlib.redirect_stdout(io.StringIO()):
        shutil.copytree(shipped_folder("data_manifest") / "rig_excerpts", folder, dirs_exist_ok=True)
        if kind == "python":
            with matplotlib.rc_context():
                exec(code, {})
        for command in code.splitlines() if kind == "sh" else ():
            assert run_command_line(shlex.split(command)[1:]) == 0, command
        return PICTURE.format(alt, base64.b64encode(Path(file).read_bytes()).decode())


def notebook(name: str) -> str:
    """Convert a notebook to Markdown: text, code and stored output; nothing is executed."""
    text = (shipped_folder("notebooks") / f"{name}.ipynb").read_text(encoding="utf-8")
    parts = []
    for cell in json.loads(text)["cells"]:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        for output in cell.get("outputs", ()):
            data = {kind: "".join(lines) for kind, lines in output.get("data", {}).items()}
            printed = "".join(output.get("text", data.get("text/plain", ""))).rstrip()
            if "image/png" in data:
                parts.append(PICTURE.format(cell["metadata"]["alt"], data["image/png"].strip()))
            else:
                parts.append(data["text/html"].replace("\n", "") if "text/html" in data else f"```none\n{printed}\n```")
    return "\n\n".join(parts)


def scene_keys() -> str:
    """List the keys of a scene file and of each table in it, with their values, from the JSON Schema of the file."""
    schema = json.loads((PACKAGE / "schemas" / "scene.json").read_text(encoding="utf-8"))
    parts = []
    for name, kind in {"": schema, **schema["definitions"]}.items():
        rows = [(f"`{key}`", cell(_describe(one))) for key, one in kind["properties"].items()]
        title = f"## {name}\n\n" if name else ""
        parts.append(f"{title}{cell(kind['description'])}\n\n{table(('key', 'takes'), rows)}")
    return "\n\n".join(parts)


def _describe(schema: dict[str, Any]) -> str:
    """Describe in words the values that a JSON Schema accepts."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"table [{name}](#{name.lower()})"
    if "anyOf" in schema:
        return " or ".join(map(_describe, schema["anyOf"]))
    if "items" in schema:
        return f"list, each: {_describe(schema['items'])}"
    return ", ".join(map(str, schema.get("enum", ()))) or schema.get("description") or schema["type"]


def cell(text: str | None) -> str:
    """Put a text on one line for a Markdown table, and escape characters that are markup there."""
    return " ".join((text or "").split()).replace("|", "\\|").replace("<", "&lt;")


def table(titles: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    """Format a table in Markdown."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (titles, ("---",) * len(titles), *rows))


def formula(translator: Any, node: Any) -> None:
    """Write a formula as MathML; a displayed formula also gets its number and a link."""
    from docutils.nodes import SkipNode, math_block
    from docutils.utils.math.latex2mathml import tex2mathml

    block = isinstance(node, math_block)
    if block:
        translator.body.append(translator.starttag(node, "div", CLASS="math"))
    if block and node["number"]:
        translator.body.append(f'<span class="eqno">({node["number"]})')
        translator.add_permalink_ref(node, "Link to this equation")
        translator.body.append("</span>")
    translator.body.append(tex2mathml(node.astext(), as_block=block) + "</div>" * block)
    raise SkipNode


def setup(app: Any) -> None:
    """Register functions of this file in Sphinx, which calls `setup`."""
    app.add_html_math_renderer("mathml", (formula, None), (formula, None))
    app.connect("source-read", fill_in)
