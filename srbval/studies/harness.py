"""Studies: definition, lookup, run, and storage of the result with the conditions under which it was made."""

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
from srbval.storage.files import check_suffix
from srbval.storage.installation import STUDY_RESULTS, cache_folder, git_revision, shipped_folder
from srbval.storage.json_files import rows_text, to_json, write_json
from srbval.storage.sources import code_sha256
from srbval.storage.stored_result import DIRTY, REPORTS, RESULT_SCHEMA_VERSION, Fingerprint, ResultKind
from srbval.storage.tables import build, read_toml

if TYPE_CHECKING:  # computing a result must not depend on the report
    from srbval.report.pages import Page

STUDIES_FOLDER = Path(__file__).parent


@dataclass(frozen=True, kw_only=True)
class StudyResult:
    """Outcome of a study: `content` (a mapping or a dataclass) to be stored, and `text` to be printed.

    Without a `name` the result is partial or preliminary and is stored only to a file given by the user.
    """

    content: Any
    text: str
    name: str | None = None


@dataclass(frozen=True, kw_only=True)
class Study:
    """Question whose answer takes minutes to compute and is stored; content of ``study.toml``.

    `kind` is ``recorded`` if the study needs external recordings. `parts` names the program's parts on which the result
    depends (`srbval.check`). `options` are the study's command options.
    """

    name: str
    question: str
    kind: ResultKind = ResultKind.EVIDENCE
    parts: tuple[str, ...] = ()
    options: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def defaults(self) -> dict[str, None]:
        """Default values of the study's options by name: None, for the complete result."""
        return {words.split()[-1].strip("-").replace("-", "_"): None for words in self.options}

    @property
    def run(self) -> Callable[[argparse.Namespace, Progress], StudyResult]:
        """Function ``run`` of the study's ``study.py``, imported on first use."""
        return cast("Callable[..., StudyResult]", importlib.import_module(f"srbval.studies.{self.name}.study").run)


def study_names() -> tuple[str, ...]:
    """Names of all studies, from the names of their folders."""
    return tuple(sorted(path.parent.name for path in STUDIES_FOLDER.glob("*/study.py")))


def load_study(name: str) -> Study:
    """Load a study by name; raises `ConfigurationError` if the name is unknown."""
    if name not in study_names():
        raise ConfigurationError(f"no study is called {name!r}. There are: {', '.join(study_names())}.")
    return build(Study, read_toml(STUDIES_FOLDER / name / "study.toml") | {"name": name}, f"{name}/study.toml")


def pages() -> tuple[Page, ...]:
    """Report pages of the studies, in the order of the report."""
    named = [name for name in study_names() if (STUDIES_FOLDER / name / "page.py").is_file()]
    found = [importlib.import_module(f"srbval.studies.{name}.page").PAGE for name in named]
    return tuple(sorted(found, key=lambda page: page.place))


def run_study(
    name: str, *, output: str | Path | None = None, jobs: int | None = None, progress: Progress = silent, **options: Any
) -> dict[str, Any]:
    """Run a study with its own `options`, store the result and return the content.

    `output` is a file to be written instead of the user's cache, `jobs` the number of parallel runs (default: one per
    core). Raises `ConfigurationError` for an unknown study or option, and the errors of the study.
    """
    study = load_study(name)
    known = study.defaults()
    if unknown := [option for option in options if option not in known]:
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
    """Run a study and store the result with command, revision, time and machine; returns result and stored content.

    The result is written to `options.output`, otherwise to the user's cache; a result without a name is written to a
    given file only. If not given, the program's git `revision` and its `behaviour` are determined: numbers computed by
    the parts on which the study depends (`srbval.check.fingerprint`). Raises `DataError` if the file cannot be
    written, or is in ``reports`` while the working tree has uncommitted changes.
    """
    from srbval.check import fingerprint

    study, path = load_study(name), Path(options.output) if options.output else None
    if path is not None:
        check_suffix(path, "JSON", (".json",))
    if revision is None:
        revision = git_revision()
        shipped = path is not None and path.resolve().parent == shipped_folder(REPORTS).resolve()
        if shipped and (revision or "").endswith(DIRTY):
            raise DataError(
                f"{path}: the working tree has uncommitted changes ({revision}), so the result could not be "
                "reproduced; commit the changes first."
            )
    started = time.perf_counter()
    found = study.run(options, progress)
    about = {"evidence_kind": study.kind.value, "minutes": round((time.perf_counter() - started) / 60, 2)}
    content = result_origin(study.name, command, revision) | about | to_json(found.content)
    if path is None and found.name is None:
        return found, content
    if behaviour is None:
        behaviour = fingerprint(*study.parts, progress=progress) if study.parts else {}
    content["code_sha256"] = code_sha256(STUDIES_FOLDER / study.name)
    content["fingerprint"] = {part: dict(behaviour[part]) for part in study.parts}
    path = path or cache_folder(STUDY_RESULTS) / f"{study.name}.json"
    write_json(path, content, rows_text)
    return found, content | {"file": path}


def result_origin(kind: str, command: str, revision: str | None) -> dict[str, Any]:
    """Describe the origin of a result of this `kind` that is stored now: date, program revision, command, machine."""
    return {
        "schema_version": RESULT_SCHEMA_VERSION,
        "kind": kind,
        "made_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "git_revision": revision,
        "command": command,
        "machine": this_machine(),
    }
