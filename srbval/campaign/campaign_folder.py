"""A campaign's folder: its plan, one result file per case, a journal of how each ended.

The result files are what counts; the journal says when and at what cost. Every line carries a check value, every result
a checksum (`storage.json_files`, `storage.hdf5_files`), so that what is read is what was written.
"""

import os
import re
import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

from srbval.campaign.case import KEY, CampaignCase, CaseOutcome, version
from srbval.campaign.lock import HOLDER
from srbval.campaign.settings import Campaign
from srbval.errors import ConfigurationError, DataError
from srbval.storage.files import atomic_write, remove_unfinished
from srbval.storage.json_files import checked_line, from_json, read_checked_line

ABOUT, PLAN, JOURNAL, TABLE, CASES = "campaign.json", "plan.jsonl", "journal.jsonl", "results.csv", "cases"
RESULT = re.compile(KEY.pattern + r"\.h5")
SHARDS = "[0-9a-f][0-9a-f]"
WHOLE_CHECK = re.compile(rb'"check": "[0-9a-f]{32}"\}')  # of a line whose writer was not killed
LONGEST_LINE = 2**24  # bytes


@dataclass(frozen=True, kw_only=True)
class About:
    """A campaign: in its file `ABOUT` and again in the first line of its plan; `version` is that of the code."""

    name: str
    title: str
    cases: int
    version: str


@dataclass(frozen=True, kw_only=True)
class JournalEntry(CaseOutcome):
    """A line of the journal: how a case ended, and when."""

    at_utc: str


@dataclass(frozen=True, kw_only=True)
class Damaged:
    """A file that is not as it was written, and what is wrong with it."""

    file: Path
    why: str


def damaged_file(file: Path, error: Exception) -> Damaged:
    """What the error says of the file."""
    return Damaged(file=file, why=str(error).removeprefix(f"{file}: "))


Read = TypeVar("Read", About, CampaignCase, JournalEntry)


class CampaignFolder:
    """The folder of one campaign."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def result_path(self, key: str) -> Path:
        """Where the result with that key belongs; spread over 256 folders, so that none gets too large."""
        if KEY.fullmatch(key) is None:
            raise DataError(f"{self.path}: {key[:40]!r} is not the key of a result; a key has 32 hexadecimal digits.")
        return self.path / CASES / key[:2] / f"{key}.h5"

    def result_keys(self) -> set[str]:
        """Keys of all results in the folder, of this plan or another."""
        found = (self.path / CASES).glob(f"{SHARDS}/*.h5")
        return {path.stem for path in found if RESULT.fullmatch(path.name) and path.name[:2] == path.parent.name}

    def write_plan(self, campaign: Campaign, cases: Sequence[CampaignCase]) -> list[Damaged]:
        """Write the plan, mend the journal and remove what killed writers left; call with the folder locked.

        Returns what was damaged. Raises `ConfigurationError` where the folder holds another campaign, `DataError` where
        it holds none but files in a campaign's place, or cannot be written.
        """
        damaged = self._take_over(campaign.name)
        self.remove_incomplete()
        about = About(name=campaign.name, title=campaign.title, cases=len(cases), version=version())
        files: dict[str, list[Any]] = {PLAN: [about, *cases], ABOUT: [about], JOURNAL: [*self.journal()]}
        try:
            for name, lines in files.items():
                with atomic_write(self.path / name) as part:
                    part.write_bytes(b"".join(map(checked_line, lines)))
        except OSError as error:
            raise DataError(f"{self.path}: the plan cannot be written ({error.strerror}).") from None
        return damaged

    def remove_incomplete(self) -> None:
        """Remove the half-written files of killed processes."""
        remove_unfinished(self.path, {ABOUT, PLAN, JOURNAL, TABLE, HOLDER}.__contains__)
        for folder in (self.path / CASES).glob(SHARDS):
            remove_unfinished(folder, lambda name: RESULT.fullmatch(name) is not None)

    def planned(self) -> list[CampaignCase]:
        """The cases of the last plan; `DataError` where there is none, or it is damaged."""
        cases: list[CampaignCase] = []
        try:
            lines = _lines(self.path / PLAN)
            about = _read(About, next(lines, b""))
            for line in lines:
                cases.append(_read(CampaignCase, line))
                if cases[-1].index != len(cases) - 1:
                    raise ValueError("another case is in its place")
            if len(cases) != about.cases:
                raise ValueError(f"it ends after {len(cases)} of {about.cases} cases")
        except (OSError, ValueError) as error:
            raise self._unreadable(PLAN, f"line {len(cases) + 1}: {error}") from None
        return cases

    def about(self) -> About:
        """Name, title, number of cases and version; `DataError` where there is no campaign, or the file is damaged."""
        try:
            return _read(About, b"".join(islice(_lines(self.path / ABOUT), 2)))
        except (OSError, ValueError) as error:
            raise self._unreadable(ABOUT, str(error)) from None

    def journal(self) -> list[JournalEntry]:
        """The intact entries of the journal, oldest first."""
        return self._journal()[0]

    def damaged(self) -> list[Damaged]:
        """What is damaged of campaign file, plan and journal; `DataError` where there is no campaign at all."""
        found = self._strange()
        if not (self._has(ABOUT) or self._has(PLAN)):
            raise self._unreadable(ABOUT, "")
        for name, read in ((ABOUT, self.about), (PLAN, self.planned)):
            try:
                read()
            except DataError as error:
                found.append(damaged_file(self.path / name, error))
        if lost := self._journal()[1]:
            found.append(Damaged(file=self.path / JOURNAL, why=f"{lost} of its lines fail their checksum"))
        return found

    def note_end(self, outcome: CaseOutcome) -> None:
        """Note in the journal how a case ended; dropped where that fails: a full disk must not end the campaign."""
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        line = checked_line(JournalEntry(**vars(outcome), at_utc=now))
        try:
            with (self.path / JOURNAL).open("ab", buffering=0) as stream:
                before = stream.tell()
                if stream.write(line) < len(line):
                    stream.truncate(before)
        except OSError:
            return

    def _take_over(self, name: str) -> list[Damaged]:
        """Make sure that the folder is this campaign's or nobody's; returns what is damaged in it."""
        if strange := self._strange():
            raise DataError(f"{strange[0].file}: {strange[0].why}; nothing was changed. Move it away, or: another -o.")
        if not any(map(self._has, (ABOUT, PLAN, JOURNAL, TABLE))):
            return []
        owners = set()
        for file in (ABOUT, PLAN):
            try:
                owners.add(_read(About, next(_lines(self.path / file), b"")).name)
            except (OSError, ValueError):
                continue
        if not owners:
            raise DataError(
                f"{self.path}: {ABOUT} and {PLAN} are missing, damaged, an earlier version's or another program's, so "
                f"nothing says whose folder it is; nothing was changed. If it is campaign {name!r}, remove those two, "
                f"{JOURNAL} and {TABLE}, and give the same command again: intact results are used. If not: another -o."
            )
        if others := owners - {name}:
            raise ConfigurationError(
                f"{self.path} holds campaign {min(others)[:80]!r}, not {name!r}; choose another -o."
            )
        return self.damaged()

    def _strange(self) -> list[Damaged]:
        """What is a link, or of another kind than this program's, in the places of its files and folders."""
        files = dict.fromkeys((self.path / name for name in (ABOUT, PLAN, JOURNAL, TABLE)), stat.S_IFREG)
        folders = dict.fromkeys((self.path / CASES, *(self.path / CASES).glob(SHARDS)), stat.S_IFDIR)
        return [
            Damaged(file=path, why="it is a link, or not the kind of file that a campaign writes there")
            for path, kind in (files | folders).items()
            if os.path.lexists(path) and stat.S_IFMT(path.lstat().st_mode) != kind
        ]

    def _journal(self) -> tuple[list[JournalEntry], int]:
        """Intact entries, and how many lines are damaged; a last one of a killed writer is not."""
        entries: list[JournalEntry] = []
        lost = 0
        try:
            for line in _lines(self.path / JOURNAL):
                try:
                    entries.append(_read(JournalEntry, line))
                except ValueError:
                    lost += line.endswith(b"\n") or WHOLE_CHECK.search(line) is not None
        except FileNotFoundError:
            return [], 0
        except (OSError, ValueError):
            lost += 1
        return entries, lost

    def _has(self, name: str) -> bool:
        return os.path.lexists(self.path / name)

    def _unreadable(self, name: str, why: str) -> DataError:
        again = f"srbval campaign run FILE.toml -o {self.path}"
        if not (self._has(ABOUT) or self._has(PLAN)):
            return DataError(f"{self.path}: no campaign here. Start one: {again}")
        state = f"damaged ({why})" if self._has(name) else "missing"
        return DataError(f"{self.path / name}: {state}. It is written again, and results are kept: {again}")


def _lines(path: Path) -> Iterator[bytes]:
    """The lines of a file, in pieces where they are too long; `ValueError` where it is not a file of its own."""
    if not stat.S_ISREG(path.lstat().st_mode):
        raise ValueError("it is not a file")
    with path.open("rb") as stream:
        while line := stream.readline(LONGEST_LINE):
            yield line


def _read(cls: type[Read], line: bytes) -> Read:
    made = from_json(cls, read_checked_line(line))
    if not (made.name.isprintable() if isinstance(made, About) else KEY.fullmatch(made.key)):
        raise ValueError("its name is not text, or its key is not the key of a result")
    return made
