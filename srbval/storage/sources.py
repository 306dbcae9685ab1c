"""Hashes of source code: of all files on which a module depends, and of the statements in one folder.

The sources of a module are its imports within the package, followed recursively; imports within functions count,
imports for type checkers do not. The name of a cached result contains the hash of its sources. A stored result of a
study contains the hash of the statements in the study's folder, which changes if the study computes in another way.
"""

import ast
import contextlib
import hashlib
import itertools
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from srbval.storage.installation import package_folder

PACKAGE_FOLDER = package_folder()

# Import statements are found by their first word and parsed alone: parsing whole files would take ten times as long.
STATEMENT = re.compile(r"^[ \t]*(?:from|import)[ \t][^\n(]*(?:\([^)]*\))?", re.MULTILINE)
FOR_TYPES = re.compile(r"^if TYPE_CHECKING:.*\n(?:[ \t]+.*\n|\n)*", re.MULTILINE)
PLACE = re.compile(r"""["']([\w.]+):\w+["']""")  # "module:name", imported at first use
# In the texts of `ast.dump`: beginnings of statements that compute nothing; docstrings, and empty fields and contexts,
# which only some versions of Python print, with a comma beside them; names of private functions, arguments and so on.
_NOT_RUN = ("Import", "Expr(value=Constant(", "If(test=Name(id='TYPE_CHECKING'", "Assign(targets=[Name(id='__all__'")
_STRING = r"""(?:'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")"""
_EMPTY = rf"(?:Expr\(value=Constant\(value={_STRING}\)\)|\w+=\[\]|ctx=Load\(\))"
_WITHOUT_EFFECT = re.compile(rf"(?:(?:, )?{_EMPTY})+(?=[)\]])|{_EMPTY}, ")
_PRIVATE_NAME = re.compile(r"\b(name|id|attr|arg)='_(?!_)\w*'")
SHOWING = ("page", "figure")
NOT_COUNTED = {"harness"}  # which runs every study and stores its result
DISPLAY_KEYS = ("question",)  # keys of a study's TOML file that only inform the reader
DATA_FILE = re.compile(r"""["']([\w-]+\.(?:toml|json|csv))["']""")


@cache
def content_version(*modules: str, package: Path = PACKAGE_FOLDER, lazy: bool = True) -> str:
    """Hash (16 digits) of all source files on which `modules` depend; for `lazy` see `sources_of`."""
    digest = hashlib.sha256()
    for source in sorted(sources_of(*modules, package=package, lazy=lazy)):
        digest.update(source.relative_to(package).as_posix().encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()[:16]


@cache
def code_sha256(folder: Path) -> str:
    """Hash of the statements in the modules and TOML files of a `folder`, 64 hexadecimal digits.

    Modules beside the folder that it imports count as well, apart from `NOT_COUNTED`. These do not count: docstrings,
    comments, formatting, the order of statements, names that begin with an underscore, modules from which names are
    imported, files named ``page`` or ``figure``, which only show the result, and the key ``question`` of TOML files.
    """
    files = [path for path in folder.iterdir() if path.suffix in (".py", ".toml") and path.stem not in SHOWING]
    imports = {name for path in files if path.suffix == ".py" for name in _imported(path.read_text(encoding="utf-8"))}
    used = {part for name in imports for part in name.split(".")} - NOT_COUNTED
    files += [path for path in folder.parent.glob("*.py") if path.stem in used]
    statements = [one for path in files for one in _statements(path)]
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
    if missing := [module for module in modules if module not in known]:
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
        with contextlib.suppress(SyntaxError):
            node = ast.parse(statement.strip()).body[0]
            if isinstance(node, ast.ImportFrom | ast.Import):
                package = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
                yield from (f"{package}{alias.name}" for alias in node.names)


def _statements(source: Path) -> list[bytes]:
    """Hash of each top-level statement of a module, except imports and ``__all__``; one hash of a whole TOML file."""
    text = source.read_text(encoding="utf-8")
    if source.suffix == ".toml":
        content = [repr({key: value for key, value in tomllib.loads(text).items() if key not in DISPLAY_KEYS})]
    else:
        trees = (tree for tree in map(ast.dump, ast.parse(text).body) if not tree.startswith(_NOT_RUN))
        content = [_PRIVATE_NAME.sub(r"\1=_", _WITHOUT_EFFECT.sub("", tree)) for tree in trees]
    return [hashlib.sha256(one.encode()).digest() for one in content]
