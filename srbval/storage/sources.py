"""Hashes of source code: of all files on which a module depends, and of the statements in one folder.

The sources of a module are its imports within the package, followed recursively; imports within functions count,
imports for type checkers do not. The name of a cached result contains the hash of its sources. A stored result of a
study contains the hash of the statements in the study's folder, which changes if the study computes in another way.
"""

import ast
import hashlib
import itertools
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from srbval.storage.installation import package_folder

PACKAGE_FOLDER = package_folder()

# Import statements are found by their first word and parsed alone: parsing whole files would take ten times as long.
STATEMENT = re.compile(r"^[ \t]*(?:from|import)[ \t][^\n(]*(?:\([^)]*\))?", re.MULTILINE)
FOR_TYPES = re.compile(r"^if TYPE_CHECKING:.*\n(?:[ \t]+.*\n|\n)*", re.MULTILINE)
PLACE = re.compile(r"""["']([\w.]+):\w+["']""")  # "module:name", imported at first use
_NOT_RUN = ("if TYPE_CHECKING:", "__all__ = ")
SHOWING = ("page", "figure")
NOT_COUNTED = {"harness"}  # which runs every study and stores its result
DISPLAY_KEYS = ("question",)  # keys of a study's TOML file that only inform the reader
_NAME_FIELDS = ("name", "id", "attr", "arg")  # fields of a syntax tree that hold identifiers
DATA_FILE = re.compile(r"""["']([\w-]+\.(?:toml|json|csv))["']""")


@cache
def content_version(*modules: str, package: Path = PACKAGE_FOLDER, lazy: bool = True) -> str:
    """Hash (16 digits) of all source files on which `modules` depend; for `lazy` see `sources_of`."""
    digest = hashlib.sha256()
    for source in sorted(sources_of(*modules, package=package, lazy=lazy)):
        digest.update(source.relative_to(package).as_posix().encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()[:16]


@cache
def code_sha256(folder: Path, package: Path = PACKAGE_FOLDER) -> str:
    """Hash of the statements in the modules and TOML files of a `folder`, 64 hexadecimal digits.

    Modules beside the folder that it imports count as well, apart from `NOT_COUNTED`. These do not count: docstrings,
    comments, formatting, the order of statements, names that begin with an underscore, modules from which names are
    imported, files named ``page`` or ``figure``, which only show the result, and the key ``question`` of TOML files.
    """
    files = [path for path in folder.iterdir() if path.suffix in (".py", ".toml") and path.stem not in SHOWING]
    imports = {name for path in files if path.suffix == ".py" for name in _imported(path.read_text(encoding="utf-8"))}
    used = {part for name in imports for part in name.split(".")} - NOT_COUNTED
    files += [path for path in folder.parent.glob("*.py") if path.stem in used]
    statements = [one for path in files for one in _statements(path, package)]
    return hashlib.sha256(b"".join(sorted(statements))).hexdigest()


def sources_of(*modules: str, package: Path = PACKAGE_FOLDER, lazy: bool = True) -> set[Path]:
    """Find the source files of `modules` and of everything they import within `package`, directly or not.

    Data files beside a module count if the module names them in quotes. If `lazy` is true, modules named in texts
    ``"module:function"`` count, too; they are imported when the function is first used. The package's ``__init__``
    itself does not count, because it only exports names. Raises `ModuleNotFoundError` for a module that does not exist.
    """
    known = {}  # file of every module by dotted name; for a sub-package its `__init__`
    for source in package.rglob("*.py"):
        parts = source.relative_to(package.parent).with_suffix("").parts
        known[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = source
    known.pop(package.name, None)
    missing = [module for module in modules if module not in known]
    if missing:
        raise ModuleNotFoundError(f"no module {missing[0]!r} in {package}")
    found: set[Path] = set()
    waiting = [file for module in modules for file in _run_by(module, known)]
    while waiting:
        source = waiting.pop()
        if source not in found:
            found.add(source)
            imported, places, data = _names_in(source.read_text(encoding="utf-8"))
            waiting += [file for name in (imported | places if lazy else imported) for file in _run_by(name, known)]
            waiting += [path for name in data if (path := source.with_name(name)).is_file()]
    return found


def _run_by(name: str, known: dict[str, Path]) -> list[Path]:
    """Files that run if a dotted name is imported: the ``__init__`` of each package in the name, and the module."""
    return [known[part] for part in itertools.accumulate(name.split("."), "{}.{}".format) if part in known]


@cache
def _names_in(text: str) -> tuple[frozenset[str], frozenset[str], list[str]]:
    """Names in a source: of imports, of modules imported at first use, and of data files."""
    return frozenset(_imported(text)), frozenset(PLACE.findall(text)), DATA_FILE.findall(text)


def _imported(text: str) -> Iterator[str]:
    """Yield the dotted names in the import statements of a source; similar lines of prose are ignored."""
    for statement in STATEMENT.findall(FOR_TYPES.sub("", text)):
        try:
            node = ast.parse(statement.strip()).body[0]
        except SyntaxError:
            continue
        if isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


@cache
def _statements(source: Path, package: Path) -> list[bytes]:
    """Hash of each top-level statement of a module, except imports and ``__all__``; one hash of a whole data file."""
    if source.suffix != ".py":
        content = source.read_bytes()
        if source.suffix == ".toml":
            told = tomllib.loads(content.decode())
            content = repr({key: value for key, value in told.items() if key not in DISPLAY_KEYS}).encode()
        return [hashlib.sha256(content).digest()]
    text, found = source.read_text(encoding="utf-8"), []
    lines = text.split("\n")
    for node in ast.parse(text).body:
        words: list[str] = []
        if not (isinstance(node, ast.Import | ast.ImportFrom) or lines[node.lineno - 1].startswith(_NOT_RUN)):
            _describe(node, f"{package.name}.", words)
        if words:
            found.append(hashlib.sha256("\n".join(words).encode()).digest())
    return found


def _describe(node: ast.AST, package_prefix: str, words: list[str]) -> None:
    """Append the content of a syntax tree, except docstrings, to `words`, equal for every version of Python."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
        return
    words.append(type(node).__name__)
    for name in node._fields:
        value: Any = getattr(node, name, None)
        if isinstance(value, ast.AST):
            _describe(value, package_prefix, words)
        elif isinstance(value, list):
            for item in value:
                if isinstance(item, ast.AST):
                    _describe(item, package_prefix, words)
                else:
                    words.append(repr(item))
            if value:  # newer versions of Python have more, empty fields
                words.append(f"end of {name}")
        elif isinstance(value, str) and value.startswith(package_prefix):  # a reference to a module, which may move
            words.append(value.partition(":")[2])
        elif name in _NAME_FIELDS and isinstance(value, str) and value.startswith("_") and not value.startswith("__"):
            words.append("_")
        elif value is not None:
            words.append(repr(value))
