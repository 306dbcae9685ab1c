"""A campaign's folder: its plan, one result file a case, a journal of what was begun and how it ended.

The result files are what counts; the journal says when and at what cost, and a line of it that was cut off is passed
over.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from srbval.campaign.case import Case, version
from srbval.campaign.settings import Campaign
from srbval.campaign.task import Outcome
from srbval.errors import ConfigurationError, DataError
from srbval.storage.strict_json import json_value, write_json
from srbval.storage.whole_file import whole_file

ABOUT, PLAN, JOURNAL, TABLE, CASES = "campaign.json", "plan.jsonl", "journal.jsonl", "results.csv", "cases"


class Store:
    """The folder of one campaign."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def path_of(self, key: str) -> Path:
        """Where the result of that name lies; 256 folders keep each of them small."""
        return self.folder / CASES / key[:2] / f"{key}.h5"

    def open(self, campaign: Campaign, cases: Sequence[Case]) -> None:
        """Write the plan and clear what killed writers left; call with the folder locked.

        Raises `ConfigurationError` where the folder holds another campaign, `DataError` where it cannot be written.
        """
        before = self._about()
        if before is not None and before["name"] != campaign.name:
            raise ConfigurationError(
                f"{self.folder} holds campaign {before['name']!r}, not {campaign.name!r}; choose another -o."
            )
        self.clear_parts()
        try:
            with whole_file(self.folder / PLAN) as part, part.open("w", encoding="utf-8") as stream:
                stream.writelines(json.dumps(json_value(case.to_dict())) + "\n" for case in cases)
            about = {"name": campaign.name, "title": campaign.title, "cases": len(cases), "version": version()}
            write_json(self.folder / ABOUT, about)
        except OSError as error:
            raise DataError(f"{self.folder}: the plan cannot be written ({error.strerror}).") from None

    def clear_parts(self) -> int:
        """Remove half-written files of killed processes; returns how many there were."""
        parts = [*self.folder.glob(".*.part"), *(self.folder / CASES).glob("*/.*.part")]
        for part in parts:
            part.unlink(missing_ok=True)
        return len(parts)

    def planned(self) -> list[Case]:
        """The cases of the last plan; `DataError` where there is none."""
        try:
            with (self.folder / PLAN).open(encoding="utf-8") as stream:
                return [Case(**json.loads(line)) for line in stream]
        except (OSError, ValueError, TypeError):
            raise DataError(
                f"{self.folder}: no campaign here. Start one: srbval campaign run FILE.toml -o {self.folder}"
            ) from None

    def about(self) -> dict[str, Any]:
        """Name, title, number of cases and version; `DataError` where there is no campaign."""
        found = self._about()
        if found is None:
            raise DataError(
                f"{self.folder}: no campaign here. Start one: srbval campaign run FILE.toml -o {self.folder}"
            )
        return found

    def _about(self) -> dict[str, Any] | None:
        try:
            found: dict[str, Any] = json.loads((self.folder / ABOUT).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return found if isinstance(found, dict) and "name" in found else None

    def present(self) -> set[str]:
        """Names of all results that are there."""
        return {path.stem for path in (self.folder / CASES).glob("*/*.h5")}

    def begun(self, key: str) -> None:
        """Note that a case is handed out."""
        self._note({"event": "begun", "key": key})

    def ended(self, outcome: Outcome) -> None:
        """Note how a case ended."""
        self._note({"event": "ended", **outcome.to_dict()})

    def journal(self) -> Iterator[dict[str, Any]]:
        """The journal's lines, oldest first."""
        try:
            stream = (self.folder / JOURNAL).open(encoding="utf-8", errors="replace")
        except OSError:
            return
        with stream:
            for line in stream:
                try:
                    entry = json.loads(line)
                except ValueError:
                    continue  # cut off when its writer was killed
                if isinstance(entry, dict) and "event" in entry and "key" in entry:
                    yield entry

    def _note(self, entry: dict[str, Any]) -> None:
        """Append a line; a full disk must not end the campaign, so one that cannot be written is let go."""
        stamp = {"at_utc": datetime.now(UTC).isoformat(timespec="milliseconds")}
        line = "\n" + json.dumps(json_value(entry | stamp))  # a line cut off before does not spoil this one
        try:
            with (self.folder / JOURNAL).open("a", encoding="utf-8") as stream:
                stream.write(line)
        except OSError:
            return


def unfinished(journal: Iterable[dict[str, Any]]) -> set[str]:
    """Cases that were begun and neither ended nor were given back: what ran when a campaign was killed."""
    open_keys: set[str] = set()
    for entry in journal:
        (open_keys.add if entry["event"] == "begun" else open_keys.discard)(entry["key"])
    return open_keys
