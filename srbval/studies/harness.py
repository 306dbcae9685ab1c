"""Studies: what a study is, and how it is found, run, stamped with its origin, and stored."""

from __future__ import annotations

import argparse
import importlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from srbval.errors import ConfigurationError, DataError
from srbval.processes.machine import this_machine
from srbval.progress import Progress, silent
from srbval.storage.cache import STUDY_RESULTS, cache_folder
from srbval.storage.files import check_suffix
from srbval.storage.installation import git_revision, shipped_folder
from srbval.storage.json_files import rows_text, to_json, write_json
from srbval.storage.sources import code_sha256
from srbval.storage.stored_result import DIRTY, REPORTS, RESULT_SCHEMA_VERSION, Fingerprint, ResultKind
from srbval.storage.tables import build, read_toml

if TYPE_CHECKING:  # what computes a result does not depend on how it is shown
    from srbval.report.pages import Page

STUDIES_FOLDER = Path(__file__).parent


@dataclass(frozen=True, kw_only=True)
class StudyResult:
    """Outcome of a study.

    `content` (a mapping or a dataclass) is stored as the result `name`; without a name it is a part or a first
    impression, stored only if a file is named for it. `text` is printed. The command ends with exit code 1 if `sound`
    is False: what the study tests does not hold.
    """

    content: Any
    text: str
    name: str | None = None
    sound: bool = True


@dataclass(frozen=True, kw_only=True)
class Study:
    """A question that takes minutes to answer and whose answer is stored: the content of its ``study.toml``.

    `minutes` is the duration on two cores. `kind`: what the result rests on. `parts`: the parts of the program that the
    result depends on, as `srbval.check.check` names them. `options`: its own, as in the commands' file.
    """

    name: str
    question: str
    minutes: float
    kind: ResultKind = ResultKind.EVIDENCE
    parts: tuple[str, ...] = ()
    options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def add_options(self, parser: argparse.ArgumentParser | argparse._ArgumentGroup) -> None:
        """Add its options to a parser, or to a group of one, that knows the types of `srbval.cli.arguments`."""
        for names, settings in self.options.items():
            parser.add_argument(*names.split(), **settings)

    def defaults(self) -> dict[str, Any]:
        """Its options by name, with their default values."""
        usual = {
            words: about.get("default", False if "action" in about else None) for words, about in self.options.items()
        }
        return {words.split()[-1].strip("-").replace("-", "_"): value for words, value in usual.items()}

    @property
    def run(self) -> Callable[[argparse.Namespace, Progress], StudyResult]:
        """The function of its ``study.py``, imported only when it is asked for."""
        return cast("Callable[..., StudyResult]", importlib.import_module(f"srbval.studies.{self.name}.study").run)


def study_names() -> tuple[str, ...]:
    """Names of all studies: those of their folders."""
    return tuple(sorted(path.parent.name for path in STUDIES_FOLDER.glob("*/study.py")))


def load_study(name: str) -> Study:
    """The study of this name; `ConfigurationError` where there is none."""
    if name not in study_names():
        raise ConfigurationError(f"no study is called {name!r}. There are: {', '.join(study_names())}.")
    return build(Study, read_toml(STUDIES_FOLDER / name / "study.toml") | {"name": name}, f"{name}/study.toml")


def pages() -> tuple[Page, ...]:
    """The pages of all studies that have one, in the order of the report."""
    named = [name for name in study_names() if (STUDIES_FOLDER / name / "page.py").is_file()]
    found = [importlib.import_module(f"srbval.studies.{name}.page").PAGE for name in named]
    return tuple(sorted(found, key=lambda page: page.place))


def run_study(
    name: str, *, output: str | Path | None = None, jobs: int | None = None, progress: Progress = silent, **options: Any
) -> dict[str, Any]:
    """Run a study with `options` of its own by the names of its command's, and store its result; returns the content.

    `output` names a file to store to in place of the user's cache, `jobs` the runs at a time (default: one per core).
    Raises `ConfigurationError` for an unknown study or option, and what the study raises.
    """
    study = load_study(name)
    known = study.defaults()
    unknown = [option for option in options if option not in known]
    if unknown:
        raise ConfigurationError(f"study {name} has no option {unknown[0]!r}. It has: {', '.join(known) or 'none'}.")
    given = argparse.Namespace(**known | options, jobs=jobs, output=output)
    return make_result(name, given, progress, command=f"srbval study run {name}")[1]


def make_result(
    name: str,
    options: argparse.Namespace,
    progress: Progress,
    *,
    command: str,
    revision: str | None = None,
    behaviour: Fingerprint | None = None,
) -> tuple[StudyResult, dict[str, Any]]:
    """Run a study and store its result with its origin; returns it, and what was stored or would have been.

    `options.output` names a file to store to in place of the user's cache. A result without a name is stored only if a
    file is named for it. `revision` and the fingerprint `behaviour` are those of the program, read here if they are not
    given. Raises `DataError` for a file that cannot be written, and for one in ``reports`` if the working tree was
    changed.
    """
    from srbval.check.check import fingerprint

    study, path = load_study(name), Path(options.output) if options.output else None
    if path is not None:
        check_suffix(path, "JSON", (".json",))
    if revision is None:
        revision = git_revision()
        shipped = path is not None and path.resolve().parent == shipped_folder(REPORTS).resolve()
        if shipped and (revision or "").endswith(DIRTY):
            raise DataError(
                f"{path}: the working tree has changes that no revision holds ({revision}), so that nobody could "
                "compute this result again; commit the changes first."
            )
    started = time.perf_counter()
    found = study.run(options, progress)
    content = {
        "schema_version": RESULT_SCHEMA_VERSION,
        "kind": study.name,
        "evidence_kind": study.kind.value,
        "made_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "git_revision": revision,
        "command": command,
        "minutes": round((time.perf_counter() - started) / 60, 2),
        "machine": this_machine(),
        **to_json(found.content),
    }
    if path is None and found.name is None:
        return found, content
    if behaviour is None:
        behaviour = fingerprint(*study.parts, progress=progress) if study.parts else {}
    content["code_sha256"] = code_sha256(STUDIES_FOLDER / study.name)
    content["fingerprint"] = {part: dict(behaviour[part]) for part in study.parts}
    path = path or cache_folder(STUDY_RESULTS) / f"{study.name}.json"
    write_json(path, content, rows_text)
    return found, content | {"file": path}
