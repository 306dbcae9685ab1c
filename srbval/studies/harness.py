"""One harness for all studies: what a study is, and how it is found, run, stamped with its origin, and stored."""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from srbval.errors import ConfigurationError, DataError
from srbval.processes.about_machine import this_machine
from srbval.progress import Progress, silent
from srbval.progress.tables import text_rows
from srbval.storage.cache import RESULTS, cache_folder
from srbval.storage.files import check_suffix, file_sha256
from srbval.storage.installation import git_revision, shipped_folder
from srbval.storage.json_files import to_json, write_json
from srbval.storage.sources import sources_sha256
from srbval.storage.stored_result import DIRTY, REPORTS, SCHEMA_VERSION, StoredResult
from srbval.storage.tables import build, read_toml

if TYPE_CHECKING:  # what computes a result does not depend on how it is shown
    from srbval.recordings.registry import RegisteredRecording
    from srbval.report.pages import Page

FOLDER = Path(__file__).parent
TYPES = ("count", "finite", "jobs", "positive", "seed")  # of options; `srbval.cli.arguments` has these and more


@dataclass(frozen=True, kw_only=True)
class StudyResult:
    """What a study found.

    `content` (a mapping or a dataclass) is stored as the result `name`; without a name it is a part or a first
    impression, stored only where a file is named for it. `text` is what is printed, behind the `tables` where all is
    asked for; `inputs` the SHA-256 of the data read, by file name. Where `sound` is False the command ends
    with exit code 1.
    """

    content: Any
    text: str
    tables: str = ""
    name: str | None = None
    inputs: Mapping[str, str] = field(default_factory=dict)
    sound: bool = True


@dataclass(frozen=True, kw_only=True)
class Study:
    """A question that takes minutes or hours to answer, and whose answer is stored: what its ``study.toml`` says.

    `minutes` is about what it takes on two cores; `parts`: parts of the program's behaviour that its numbers depend on.
    `options`: its own, as arguments stand in the commands' file; what
    they leave out is a constant of ``study.py``, on which the result depends.
    """

    name: str
    question: str
    minutes: float
    kind: str = "evidence"
    parts: tuple[str, ...] = ()
    options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def add_options(self, parser: argparse.ArgumentParser) -> None:
        """Add them to a parser that knows the types of `srbval.cli.arguments`; the options of all are there already."""
        for names, settings in self.options.items():
            parser.add_argument(*names.split(), **settings)

    @property
    def run(self) -> Callable[[argparse.Namespace, Progress], StudyResult]:
        """The function of its ``study.py``, imported only when it is asked for."""
        function: Callable[[argparse.Namespace, Progress], StudyResult]
        function = importlib.import_module(f"srbval.studies.{self.name}.study").run
        return function


def study_names() -> tuple[str, ...]:
    """Names of all studies: those of their folders."""
    return tuple(sorted(path.parent.name for path in FOLDER.glob("*/study.py")))


def load_study(name: str) -> Study:
    """The study of this name; `ConfigurationError` where there is none."""
    if name not in study_names():
        raise ConfigurationError(f"no study is called {name!r}. There are: {', '.join(study_names())}.")
    return build(Study, read_toml(FOLDER / name / "study.toml") | {"name": name}, f"{name}/study.toml")


def pages() -> tuple[Page, ...]:
    """The pages of all studies that have one, in the order of the report: of their ``page.py``, or of texts alone."""
    of_texts = importlib.import_module("srbval.report.pages").page_of_texts
    found: list[Page] = []
    for name in study_names():
        if (FOLDER / name / "page.py").is_file():
            found.append(importlib.import_module(f"srbval.studies.{name}.page").PAGE)
        elif (FOLDER / name / "texts.toml").is_file():
            found.append(of_texts(f"srbval.studies.{name}"))
    return tuple(sorted(found, key=lambda page: page.place))


def run_study(
    name: str, *, output: str | Path | None = None, jobs: int | None = None, progress: Progress = silent, **options: Any
) -> dict[str, Any]:
    """Run a study with `options` of its own by the names of its command's, and store its result; returns the content.

    `output` names a file to store to in place of the user's cache, `jobs` the runs at a time (default: one per core).
    Raises `ConfigurationError` for an unknown study or option, and what the study raises.
    """
    study, parser = load_study(name), argparse.ArgumentParser()
    for kind in TYPES:
        parser.register("type", kind, lambda value: value)  # values from Python are what they are
    study.add_options(parser)
    known = vars(parser.parse_args([]))
    unknown = [option for option in options if option not in known]
    if unknown:
        raise ConfigurationError(f"study {name} has no option {unknown[0]!r}. It has: {', '.join(known) or 'none'}.")
    given = argparse.Namespace(**known | options, jobs=jobs, output=output)
    return make_result(name, given, progress, command=f"srbval study run {name}")[1]


def make_result(
    name: str, options: argparse.Namespace, progress: Progress, *, command: str
) -> tuple[StudyResult, dict[str, Any]]:
    """Run a study and store its result; returns it, and what was stored or would have been.

    The revision of the program is the one at the beginning: a study may take hours. `options.output` names a file to
    store to in place of the user's cache.
    """
    if options.output:
        check_suffix(Path(options.output), "JSON", (".json",))
    revision = git_revision()
    found = load_study(name).run(options, progress)
    content: dict[str, Any] = {"machine": this_machine()} | to_json(found.content)
    if options.output or found.name:
        stored = store_result(
            found.name or name, content, computed_by=f"srbval.studies.{name}.study", inputs=found.inputs,
            command=command, revision=revision, path=Path(options.output) if options.output else None,
        )  # fmt: skip
        print(f"stored: {stored.path}", file=sys.stderr)
        return found, stored.content | {"file": stored.path}
    return found, stamped(found.name or name, content, command=command, revision=revision)


def store_result(
    name: str,
    content: Mapping[str, Any],
    *,
    computed_by: str,
    inputs: Mapping[str, str] | None = None,
    command: str,
    revision: str | None,
    path: Path | None = None,
) -> StoredResult:
    """Write `content` with its origin to `path`, by default to the user's cache.

    `computed_by`: the module whose sources it depends on; `inputs`: SHA-256 of the data that were read, by name;
    `command`: what computed it; `revision`: that of the program when that began. Raises `DataError` where the file
    cannot be written, and for a `path` in the repository's ``reports`` where the working tree was changed: the result
    is kept in the cache then, and does not come with the program.
    """
    stamped_content = stamped(name, {
        "computed_by": computed_by, "sources_sha256": sources_sha256(computed_by), "inputs_sha256": dict(inputs or {}),
        **content,
    }, command=command, revision=revision)  # fmt: skip
    cached = cache_folder(RESULTS) / f"{name}.json"
    refused = path is not None and (revision or "").endswith(DIRTY) and _is_shipped(path)
    stored = StoredResult(path=cached if path is None or refused else path, content=stamped_content)
    write_json(stored.path, stored.content, rows_text)
    if refused:
        raise DataError(
            f"{path}: the working tree has changes that no revision holds ({revision}), so that nobody could compute "
            f"this result again. It is kept as {cached}; commit the changes and compute it again."
        )
    return stored


def stamped(kind: str, result: Mapping[str, Any], *, command: str, revision: str | None) -> dict[str, Any]:
    """`result` with its kind, the date, the `command` that made it and the `revision` read when that began."""
    return {
        "schema_version": SCHEMA_VERSION,
        "kind": kind,
        "made_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "git_revision": revision,
        "command": command,
        **result,
    }


def _is_shipped(path: Path) -> bool:
    return path.resolve().parent == shipped_folder(REPORTS).resolve()


def rows_text(content: Mapping[str, Any]) -> str:
    """One JSON document in which every row of a list has a line: half the size of `json_text`, and still compared."""

    def text(value: Any) -> str:
        return json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)

    items = (
        f"{text(key)}: " + ("[\n" + ",\n".join(map(text, value)) + "\n]" if isinstance(value, list) else text(value))
        for key, value in to_json(content).items()
    )
    return "{" + ",\n".join(items) + "}\n"


def input_hashes(*read: RegisteredRecording | StoredResult | Path | None) -> dict[str, str]:
    """SHA-256 of what a study read, by name: ``reports/...`` and ``data_manifest/...`` of what comes with the program.

    Anything else by its folder and file. None is nothing that was read.
    """
    shipped, found = [shipped_folder(name).resolve() for name in (REPORTS, "data_manifest")], {}
    for one in read:
        if one is not None:
            path = one if isinstance(one, Path) else one.path if isinstance(one, StoredResult) else Path(one.file)
            path = path.resolve()
            root = next((folder.parent for folder in shipped if path.is_relative_to(folder)), path.parents[1])
            found[path.relative_to(root).as_posix()] = file_sha256(path)
    return found


def printed_columns(package: str, table: str, rows: Sequence[Mapping[str, Any]]) -> str:
    """`rows` as text in the columns that ``columns.toml`` of a study's `package` names for a `table`."""
    columns = tomllib.loads((files(package) / "columns.toml").read_text(encoding="utf-8"))
    return text_rows(rows, columns[table])
