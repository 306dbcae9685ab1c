"""A campaign's folder: one result file per case, and one file with its plan and a journal of how each case ended.

The result files are what counts; the journal says when and at what cost. Every line of that file carries a check value,
every result a checksum (`storage.json_files`, `storage.hdf5_files`), so that what is read is what was written.
"""

import contextlib
import os
import platform
import re
import stat
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

from srbval.campaign.case import KEY, CampaignCase, CaseResult, read_result, version
from srbval.errors import ConfigurationError, DataError
from srbval.storage.files import atomic_write, remove_unfinished
from srbval.storage.json_files import checked_line, from_json, parse_json, read_checked_line, write_json

PLAN, TABLE, CASES = "campaign.jsonl", "results.csv", "cases"
LOCK, HOLDER = "lock", "lock-holder.json"
LONGEST_HOLDER = 1000  # bytes about a holder
SHARDS = "[0-9a-f][0-9a-f]"
ENTRY = b'{"ended": '
WHOLE_CHECK = re.compile(rb'"check": "[0-9a-f]{32}"\}')  # of a line whose writer was not killed
LONGEST_LINE = 2**24  # bytes


@dataclass(frozen=True, kw_only=True)
class About:
    """A campaign, in the lines before and behind its plan; `version` is that of the code."""

    name: str
    title: str
    cases: int
    version: str


@dataclass(frozen=True, kw_only=True)
class Damaged:
    """A file that is not as it was written, and what is wrong with it."""

    file: Path
    why: str


@dataclass(kw_only=True)
class Journal:
    """What is intact of a campaign's file: its plan, and the results that ended, oldest first, without their numbers.

    `damage` says what is not, empty if nothing; without a whole plan there are no `cases`.
    """

    about: About | None = None
    cases: list[CampaignCase] = field(default_factory=list)
    ended: list[CaseResult] = field(default_factory=list)
    damage: str = ""


class CampaignFolder:
    """The folder of one campaign."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = path / PLAN

    def result_path(self, key: str) -> Path:
        """Where the result with that key belongs; spread over 256 folders, so that none gets too large."""
        if KEY.fullmatch(key) is None:
            raise DataError(f"{self.path}: {key[:40]!r} is not the key of a result; a key has 32 hexadecimal digits.")
        return self.path / CASES / key[:2] / f"{key}.h5"

    def result_keys(self) -> set[str]:
        """Keys of all results in the folder, of this plan or another."""
        found = (self.path / CASES).glob(f"{SHARDS}/*.h5")
        return {path.stem for path in found if KEY.fullmatch(path.stem) and path.stem[:2] == path.parent.name}

    def write_plan(self, name: str, title: str, cases: Sequence[CampaignCase]) -> list[Damaged]:
        """Write the plan, mend the journal and remove what killed writers left; call with the folder locked.

        Returns what was damaged. Raises `ConfigurationError` where the folder holds another campaign, `DataError` where
        it holds none but files in a campaign's place, or cannot be written.
        """
        if strange := self._strange():
            raise DataError(f"{strange[0].file}: {strange[0].why}; nothing was changed. Move it away, or: another -o.")
        new = not any(os.path.lexists(self.path / file) for file in (PLAN, TABLE))
        old = Journal() if new else self.journal()
        if not new and old.about is None:
            raise DataError(
                f"{self._file}: missing, damaged or another program's, so nothing says whose folder it is; nothing was "
                f"changed. If it is campaign {name!r}, remove {PLAN} and {TABLE}, and give the same command again: "
                "intact results are used. If not: another -o."
            )
        if old.about is not None and old.about.name != name:
            raise ConfigurationError(
                f"{self.path} holds campaign {old.about.name[:80]!r}, not {name!r}; choose another -o."
            )
        self.remove_incomplete()
        about = {"about": About(name=name, title=title, cases=len(cases), version=version())}
        lines = [about, *({"case": case} for case in cases), about, *({"ended": result} for result in old.ended)]
        with atomic_write(self._file) as part:
            part.write_bytes(b"".join(map(checked_line, lines)))
        return [Damaged(file=self._file, why=old.damage)] if old.damage else []

    def note_end(self, result: CaseResult) -> None:
        """Note in the journal how a case ended; dropped where that fails: a full disk must not end the campaign."""
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        line = checked_line({"ended": replace(result, quantities=(), at_utc=now)})
        try:
            with self._file.open("ab", buffering=0) as stream:
                before = stream.tell()
                if stream.write(line) < len(line):
                    stream.truncate(before)
        except OSError:
            return

    def journal(self, *, planned: bool = False) -> Journal:
        """What is intact of the campaign's file.

        Raises `DataError` where there is no campaign; if `planned`, also without a whole plan.
        """
        found, lost, places = Journal(), 0, dict[int, CampaignCase]()
        again = f"srbval campaign run FILE.toml -o {self.path}"
        try:
            for line in self._lines():
                made = _read(line)
                if isinstance(made, About):
                    found.about = found.about or made
                elif isinstance(made, CampaignCase):
                    places[made.index] = made
                elif made is not None:
                    found.ended.append(made)
                lost += made is None and not _is_unfinished(line)
        except OSError as error:
            if os.path.isdir(self.path) and not isinstance(error, FileNotFoundError):
                found.damage = f"it cannot be read ({error.strerror})"
            elif not os.path.lexists(self.path / TABLE):
                raise DataError(f"{self.path}: no campaign here. Start one: {again}") from None
        if found.about is not None and sorted(places) == list(range(found.about.cases)):
            found.cases = [places[index] for index in range(len(places))]
            found.damage = f"{lost} of its lines fail their checksum" if lost else ""
        else:
            of = "an unknown number of" if found.about is None else found.about.cases
            found.damage = found.damage or f"{len(places)} of {of} cases are intact in its plan"
            if planned:
                raise DataError(
                    f"{self._file}: damaged ({found.damage}). It is written again, and results are kept: {again}"
                )
        return found

    def read_results(self, keys: Iterable[str]) -> tuple[dict[str, CaseResult], dict[str, Damaged]]:
        """The results of `keys` that are intact and those that are damaged; the others are missing."""
        intact, damaged = dict[str, CaseResult](), dict[str, Damaged]()
        for key in dict.fromkeys(keys):
            found = result_state(self.result_path(key))
            if isinstance(found, Damaged):
                damaged[key] = found
            elif found is not None:
                intact[key] = found
        return intact, damaged

    def remove_results(self, keys: Iterable[str]) -> None:
        """Remove these results; a folder in the place of one is renamed, since this program did not write it."""
        for path in map(self.result_path, keys):
            try:
                if path.is_dir() and not path.is_symlink():
                    path.rename(path.with_name(f"{path.name}.{time.time_ns()}.aside"))
                else:
                    path.unlink(missing_ok=True)
            except OSError as error:
                raise DataError(f"{path}: damaged, and cannot be removed ({error.strerror}). Remove it.") from None

    def remove_incomplete(self) -> None:
        """Remove the half-written files of killed processes."""
        remove_unfinished(self.path, {PLAN, TABLE, HOLDER}.__contains__)
        for folder in (self.path / CASES).glob(SHARDS):
            remove_unfinished(folder, lambda name: name.endswith(".h5") and KEY.fullmatch(name[:-3]) is not None)

    def damaged(self, journal: Journal) -> list[Damaged]:
        """Links, and other kinds of file than this program's, in the places of its own; a damaged plan or journal."""
        found = self._strange()
        if journal.damage and self._file not in [strange.file for strange in found]:
            found.append(Damaged(file=self._file, why=journal.damage))
        return found

    def _strange(self) -> list[Damaged]:
        files = dict.fromkeys((self._file, self.path / TABLE), stat.S_IFREG)
        folders = dict.fromkeys((self.path / CASES, *(self.path / CASES).glob(SHARDS)), stat.S_IFDIR)
        return [
            Damaged(file=path, why="it is a link, or not the kind of file that a campaign writes there")
            for path, kind in (files | folders).items()
            if os.path.lexists(path) and stat.S_IFMT(path.lstat().st_mode) != kind
        ]

    def _lines(self) -> Iterator[bytes]:
        """The lines of the campaign's file, in pieces where they are too long; none of what is no file of its own."""
        try:
            regular = stat.S_ISREG(self._file.lstat().st_mode)
        except ValueError as error:  # no file can have such a name
            raise DataError(f"{str(self.path)!r} is no folder of a campaign: {error}.") from None
        if regular:
            with self._file.open("rb") as stream:
                while line := stream.readline(LONGEST_LINE):
                    yield line


def result_state(path: Path) -> CaseResult | Damaged | None:
    """The result in a file, what is wrong with that file, or None where there is none."""
    try:
        if stat.S_ISREG(path.lstat().st_mode):
            return read_result(path)
        return Damaged(file=path, why="a link, a folder or another kind of file is in a result's place.")
    except FileNotFoundError:
        return None
    except (OSError, DataError) as error:
        return Damaged(file=path, why=str(error).removeprefix(f"{path}: "))


def _read(line: bytes) -> About | CampaignCase | CaseResult | None:
    """What a line says; None where it is not as it was written."""
    try:
        ((kind, table),) = read_checked_line(line).items()
        kinds: dict[str, type[About | CampaignCase | CaseResult]]
        kinds = {"about": About, "case": CampaignCase, "ended": CaseResult}
        made = from_json(kinds[kind], table)
    except (ValueError, KeyError):
        return None
    valid = made.name.isprintable() if isinstance(made, About) else KEY.fullmatch(made.key)
    return made if valid else None


def _is_unfinished(line: bytes) -> bool:
    """Was its writer killed? What else looks so is damaged."""
    begun = line.startswith(ENTRY[: len(line)]) and not line.endswith(b"\n")
    return begun and b"\0" not in line and WHOLE_CHECK.search(line) is None


@contextlib.contextmanager
def folder_lock(folder: Path) -> Iterator[str | None]:
    """Hold `folder` exclusively. Yields who held it last if that process was killed, otherwise None.

    The system releases the lock when its process ends, however it ends.

    Raises `ConfigurationError` where another process holds it, `DataError` where the folder cannot be written.
    """
    from filelock import FileLock, Timeout

    try:
        folder.mkdir(parents=True, exist_ok=True)
        acquired = FileLock(folder / LOCK, blocking=False).acquire()
    except Timeout:
        raise ConfigurationError(
            f"{folder}: another campaign runs in this folder{_holder(folder)}. Wait for its end "
            f"(srbval campaign status {folder}), or choose another -o."
        ) from None
    except OSError as error:
        raise DataError(
            f"{folder}: cannot be written ({error.strerror}). Choose another folder with -o, or free this one."
        ) from None
    with acquired:
        killed = _holder(folder) or None
        now = datetime.now(UTC).isoformat(timespec="seconds")
        with contextlib.suppress(DataError):  # whom to name is not worth a campaign
            write_json(folder / HOLDER, {"pid": os.getpid(), "host": platform.node(), "since_utc": now})
        try:
            yield killed
        finally:
            with contextlib.suppress(OSError):
                (folder / HOLDER).unlink()


def holder(folder: Path) -> str | None:
    """Who runs a campaign in `folder` now; None where nobody does."""
    from filelock import FileLock, Timeout

    with contextlib.suppress(OSError):
        if (folder / LOCK).exists():
            try:
                FileLock(folder / LOCK, blocking=False).acquire().lock.release()
            except Timeout:
                return _holder(folder) or " (process unknown)"
    return None


def _holder(folder: Path) -> str:
    """Text about who took the lock last and did not release it; empty where it was released."""
    try:
        file = folder / HOLDER
        written = parse_json(file.read_bytes() if file.is_file() and file.stat().st_size < LONGEST_HOLDER else b"")
        text = f" (process {written['pid']} on {written['host']} since {written['since_utc']})"
        return text if text.isprintable() else " (process unknown)"
    except (OSError, ValueError, KeyError, TypeError):
        return ""
