"""The layout is the pipeline: a room imports only from rooms above it in this list, and nothing in a circle."""

import ast
import functools
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import srbval

GIVEN = ("errors", "arrays", "butterworth", "storage", "bridges", "progress", "processes", "bearing", "scene")
READ = ("models", "recordings", "signal", "reading", "diagnosis", "monitoring", "sweep", "comparison", "path", "plan")
ORDER = (*GIVEN, *READ, "campaign", "check", "validation", "report", "studies", "cli")
PACKAGE = Path(srbval.__file__).parent
PATHS = sorted(PACKAGE.rglob("*.py"))
FILES = [path for path in PATHS if path.parent not in (PACKAGE, PACKAGE / "docs")]
DRAWING = ("srbval.report.", "matplotlib")
WRITING_FUNCTIONS = {"to_json", "json_text", "write_json", "move_listed_files", "content_sha256", "import_library"}
WRITING_FUNCTIONS |= {"in_processes", "usable_cores"}  # figures are drawn in processes
GATHERING = ("findings", "pages.py", "reports.py")  # of the report: what is shown, before anything is drawn
EMPTY_WORDS = """
    all answers behind beside both columns counts data drawn each entries facts few found given held here items kept
    kinds known least lines lists looks made many marks more most names numbers one ones other others own parts read
    rest results rows said same shown small stated stored tables taken texts things told values whole words
"""
LIMITS = Path(__file__).with_name("size_limits.toml")
MOST_ARGUMENTS = 8  # of a function that is neither a kernel nor a public entry point
LEAST_OF_ITS_OWN = 60  # lines of a file that one other file imports; a shorter one belongs into that one
LONGEST_FUNCTION = 80  # lines; more does not fit on a screen. Kernels are compiled as a whole and may be longer.


def module_name(path: Path) -> str:
    """Dotted name of a file of the package."""
    return ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")


MODULES = {module_name(path) for path in PATHS}


@functools.cache
def sources() -> dict[Path, ast.Module]:
    """Syntax trees of the package's files, parsed at the first use: every worker imports this file, one runs it."""
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in PATHS}


def imported(tree: ast.AST) -> Iterator[str]:
    """Every module of the package that is imported anywhere in a file, within functions and for types too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "srbval":
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield inner if inner in MODULES else node.module or ""
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] == "srbval")


def imported_rooms(path: Path) -> set[str]:
    """Rooms that a file imports from, for types too."""
    return {name.split(".")[1] for name in imported(sources()[path]) if "." in name}


def test_imports_only_run_forward():
    for path in FILES:
        place = ORDER.index(path.relative_to(PACKAGE).parts[0])
        later = {room for room in imported_rooms(path) if ORDER.index(room) > place}
        assert not later, f"{path.relative_to(PACKAGE)} must not import {later}"


def test_no_import_circle():
    """Imports within functions and those for types alone count: they only hide a circle."""
    graph = {module_name(path): set(imported(tree)) - {module_name(path)} for path, tree in sources().items()}
    del graph["srbval"]  # its names are loaded when they are used
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_nothing_imports_the_whole_package():
    """`import srbval` needs no path and no name that a room does not offer itself; the version alone stands there."""
    for path in FILES:
        for node in ast.walk(sources()[path]):
            if isinstance(node, ast.Import):
                assert "srbval" not in [alias.name for alias in node.names], path
            if isinstance(node, ast.ImportFrom) and node.module == "srbval":
                assert {alias.name for alias in node.names} <= {"__version__", *ORDER}, path


def names_of_modules() -> Iterator[tuple[str, str]]:
    """Names of functions, classes and constants of modules, with their module.

    Type variables are left out, and the folders of studies, each of which has the functions of the others.
    """
    for path in FILES:
        for node in sources()[path].body if path.parent.parent.name != "studies" else ():
            value = getattr(node, "value", None)
            if isinstance(value, ast.Call) and ast.unparse(value.func) == "TypeVar":
                continue
            targets = getattr(node, "targets", [getattr(node, "target", None)])
            named = [name.id for target in targets if target for name in ast.walk(target) if isinstance(name, ast.Name)]
            for name in named if isinstance(node, ast.Assign | ast.AnnAssign) else [getattr(node, "name", "_")]:
                yield name, module_name(path)


def test_no_public_name_occurs_twice():
    modules: dict[str, set[str]] = {}
    for name, module in names_of_modules():
        if not name.startswith("_"):
            modules.setdefault(name, set()).add(module)
    assert {name: found for name, found in modules.items() if len(found) > 1} == {}
    nodes = [node for tree in sources().values() for node in ast.walk(tree)]
    classes = Counter(node.name for node in nodes if isinstance(node, ast.ClassDef))
    assert [name for name, count in classes.items() if count > 1] == []


def test_no_name_is_an_empty_word():
    words = EMPTY_WORDS.split()
    assert [f"{module}.{name}" for name, module in names_of_modules() if name.strip("_").lower() in words] == []


def offered(path: Path) -> set[str]:
    """Names that an ``__init__`` takes in from the modules of its folder where it does nothing else."""
    _, *rest = sources()[path].body
    imports = [node for node in rest if isinstance(node, ast.ImportFrom)]
    return {alias.name for node in imports for alias in node.names} if len(imports) == len(rest) else set()


def test_one_import_path_for_each_name():
    """What a folder's ``__init__`` offers the files outside import from the folder, not from the module."""
    folders = {module_name(p): offered(p) for p in FILES if p.name == "__init__.py" and offered(p)}
    for path, tree in sources().items():
        for node in ast.walk(tree):
            if not isinstance(node, ast.ImportFrom) or node.module in folders:
                continue
            for folder, names in folders.items():
                if (node.module or "").startswith(folder + ".") and not module_name(path).startswith(folder):
                    twice = names & {alias.name for alias in node.names}
                    assert not twice, f"{path.relative_to(PACKAGE)}: import {twice} from {folder}"


def limits(text: str) -> dict[str, int]:
    """The limits that a file of limits states."""
    return {name: int(value) for name, value in tomllib.loads(text)["limits"].items()}


def lines_of(files: Iterable[Path]) -> int:
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files)


def words_of(files: Iterable[Path]) -> int:
    return sum(len(path.read_text(encoding="utf-8").split()) for path in files)


def concepts() -> dict[str, int]:
    """What a newcomer has to learn: classes, commands with their actions, studies."""
    commands = tomllib.loads((PACKAGE / "cli" / "commands.toml").read_text(encoding="utf-8"))["commands"]
    return {
        "classes": sum(isinstance(node, ast.ClassDef) for tree in sources().values() for node in ast.walk(tree)),
        "commands": sum(max(1, len(command.get("actions", {}))) for command in commands.values()),
        "studies": len(list((PACKAGE / "studies").glob("*/study.py"))),
    }


def test_there_is_not_too_much():
    """So that the whole of it can be read, and a newcomer finds the file to change; packed lines do not help."""
    root, tests = PACKAGE.parent, list(Path(__file__).parent.rglob("*.py"))
    studies = [path for path in PATHS if path.relative_to(PACKAGE).parts[0] == "studies"]
    documents = [path for folder in ("srbval", "data_manifest", "tests") for path in (root / folder).rglob("*.md")]
    documents += root.glob("*.md")
    shown = [path for path in documents if path.stem == "texts" or path.parent.name == "texts"]  # of the report
    skipped = (f"{path.read_text(encoding='utf-8')}".count("# fmt: " + "skip") for path in (*PATHS, *tests))
    found = {
        "files": len(PATHS),
        "lines": lines_of(PATHS),
        "lines_of_studies": lines_of(studies),
        "lines_of_tests": lines_of(tests),
        "lines_of_toml": lines_of(PACKAGE.rglob("*.toml")),
        "words_of_documents": words_of(set(documents) - set(shown)),
        "words_of_report_texts": words_of(shown),
        "lines_without_formatting": sum(skipped),
    } | concepts()
    allowed = limits(LIMITS.read_text(encoding="utf-8"))
    assert {name: value for name, value in found.items() if value > allowed[name]} == {}, (found, allowed)


def test_limits_only_fall():
    """A limit is not above its value in the commit before, except for what the file allows for a feature."""
    text = LIMITS.read_text(encoding="utf-8")
    now, allowed = limits(text), tomllib.loads(text).get("allowed", {})
    for revision in ("HEAD", "HEAD~1"):
        command = ["git", "show", f"{revision}:./{LIMITS.name}"]
        shown = subprocess.run(command, cwd=LIMITS.parent, capture_output=True, text=True, check=False)
        if shown.returncode:
            pytest.skip(f"no {LIMITS.name} in {revision} to compare with")
        before, known = limits(shown.stdout), tomllib.loads(shown.stdout).get("allowed", {})
        new = [counts for feature, counts in allowed.items() if feature not in known]
        more = {name: sum(counts.get(name, 0) for counts in new) for name in now}
        above = [name for name in before if name in now and now[name] > before[name] + more[name]]
        assert above == [], f"above the limits of {revision}"


def test_no_small_file_has_a_single_importer():
    """A file of a few lines that one other file imports is a part of that file."""
    importers = Counter(name for path, tree in sources().items() for name in set(imported(tree)) - {module_name(path)})
    small = [
        str(path.relative_to(PACKAGE))
        for path in FILES
        if path.name != "__init__.py"
        and not path.stem.endswith("_kernel")
        and importers[module_name(path)] == 1
        and lines_of([path]) < LEAST_OF_ITS_OWN
        and path.stem not in STUDY_FILES
    ]
    assert len(small) <= limits(LIMITS.read_text(encoding="utf-8"))["small_files_of_one_importer"], small


STUDY_FILES = ("study", "page", "figure")  # every study has the same few


def functions() -> Iterator[tuple[str, ast.FunctionDef]]:
    """Functions that are no kernels, with their files and names."""
    for path, tree in sources().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef) and not path.stem.endswith("_kernel"):
                yield f"{path.relative_to(PACKAGE)}: {node.name}", node


def test_functions_are_short_and_do_not_take_too_many_arguments():
    long = [name for name, node in functions() if (node.end_lineno or 0) - node.lineno >= LONGEST_FUNCTION]
    assert long == []
    many = [
        name
        for name, node in functions()
        if node.name not in srbval.__all__
        and len([*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]) > MOST_ARGUMENTS
    ]
    assert len(many) <= limits(LIMITS.read_text(encoding="utf-8"))["functions_with_many_arguments"], many


def test_nothing_outside_the_studies_imports_one():
    """But for the commands; and no study imports another one."""
    for path, tree in sources().items():
        room, *inner = path.relative_to(PACKAGE).parts
        for name in imported(tree):
            parts = name.split(".")
            if parts[1:2] == ["studies"]:
                assert room in ("studies", "cli", "__init__.py"), f"{path.relative_to(PACKAGE)} imports {name}"
                shared = len(parts) == 3 and (PACKAGE / "studies" / f"{parts[2]}.py").is_file()
                own = room == "studies" and parts[2:3] == inner[:1]
                assert shared or own or len(parts) == 2, f"{path.relative_to(PACKAGE)} imports {name}"


def test_nothing_below_the_report_draws():
    for path in FILES:
        if ORDER.index(path.relative_to(PACKAGE).parts[0]) < ORDER.index("report"):
            assert "matplotlib" not in path.read_text(encoding="utf-8"), path


def test_the_report_computes_nothing():
    """Of other rooms it takes types and constants, and of functions those that write what is; its findings compute."""
    for path in (PACKAGE / "report").rglob("*.py"):
        if path.relative_to(PACKAGE / "report").parts[0] in GATHERING:
            continue
        for node in ast.walk(sources()[path]):
            if isinstance(node, ast.ImportFrom) and not f"{node.module}.".startswith(DRAWING):
                names = {alias.name for alias in node.names} if f"{node.module}.".startswith("srbval.") else set()
                functions = {name for name in names if name.islower() and name != "__version__"}
                assert functions <= WRITING_FUNCTIONS, f"{path.relative_to(PACKAGE)}: {functions}"


def test_signal_knows_only_arrays():
    for path in (PACKAGE / "signal").glob("*.py"):
        assert imported_rooms(path) <= {"errors", "arrays", "butterworth", "bridges", "signal"}, path.name


# What each may load beside numpy: scipy.stats takes as long to load as a record to analyse.
HEAVY = {"numba", "matplotlib", "pandas", "h5py", "pywt"}
HEAVY |= {f"scipy.{name}" for name in ("fft", "interpolate", "io", "linalg", "ndimage", "optimize", "signal", "sparse")}
HEAVY |= {f"scipy.{name}" for name in ("special", "stats")}
ANALYSE = {"scipy.fft", "scipy.linalg", "scipy.ndimage", "scipy.special"}


@pytest.mark.parametrize(("command", "allowed"), [("--help", set()), ("analyse OR_877rpm_sample.h5", ANALYSE)])
def test_commands_load_nothing_heavy(command, allowed):
    code = f"import sys; from srbval.cli import run_command_line\ntry: run_command_line({command.split()})\n"
    code += f"finally: print(*{HEAVY - allowed} & set(sys.modules), file=sys.stderr)"
    assert subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stderr == "\n"
