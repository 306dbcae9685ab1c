"""A campaign's folder: its plan, one result file per case, a journal of what was started and how it ended.

The result files are what counts; the journal says when and at what cost, and an incomplete line of it is skipped.
"""

import json
from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from srbval.campaign.case import CampaignCase, CaseOutcome, version
from srbval.campaign.settings import Campaign
from srbval.errors import ConfigurationError, DataError
from srbval.storage.strict_json import json_object, json_value, write_json
from srbval.storage.whole_file import whole_file

ABOUT, PLAN, JOURNAL, TABLE, CASES = "campaign.json", "plan.jsonl", "journal.jsonl", "results.csv", "cases"
STARTED, ENDED = "begun", "ended"  # events of the journal


class CampaignFolder:
    """The folder of one campaign."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def result_path(self, key: str) -> Path:
        """Where the result with that key belongs; spread over 256 folders, so that none gets too large."""
        return self.path / CASES / key[:2] / f"{key}.h5"

    def write_plan(self, campaign: Campaign, cases: Sequence[CampaignCase]) -> None:
        """Write the plan and remove what killed writers left; call with the folder locked.

        Raises `ConfigurationError` where the folder holds another campaign, `DataError` where it cannot be written.
        """
        before = self._about()
        if before is not None and before["name"] != campaign.name:
            raise ConfigurationError(
                f"{self.path} holds campaign {before['name']!r}, not {campaign.name!r}; choose another -o."
            )
        self.remove_incomplete()
        try:
            with whole_file(self.path / PLAN) as part, part.open("w", encoding="utf-8") as stream:
                stream.writelines(json.dumps(json_object(case)) + "\n" for case in cases)
            about = {"name": campaign.name, "title": campaign.title, "cases": len(cases), "version": version()}
            write_json(self.path / ABOUT, about)
        except OSError as error:
            raise DataError(f"{self.path}: the plan cannot be written ({error.strerror}).") from None

    def remove_incomplete(self) -> None:
        """Remove the half-written files of killed processes."""
        for part in (*self.path.glob(".*.part"), *(self.path / CASES).glob("*/.*.part")):
            part.unlink(missing_ok=True)

    def planned(self) -> list[CampaignCase]:
        """The cases of the last plan; `DataError` where there is none."""
        try:
            with (self.path / PLAN).open(encoding="utf-8") as stream:
                return [CampaignCase(**json.loads(line)) for line in stream]
        except (OSError, ValueError, TypeError):
            raise self._no_campaign() from None

    def about(self) -> dict[str, Any]:
        """Name, title, number of cases and version; `DataError` where there is no campaign."""
        found = self._about()
        if found is None:
            raise self._no_campaign()
        return found

    def _about(self) -> dict[str, Any] | None:
        try:
            found: dict[str, Any] = json.loads((self.path / ABOUT).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return found if isinstance(found, dict) and "name" in found else None

    def _no_campaign(self) -> DataError:
        return DataError(f"{self.path}: no campaign here. Start one: srbval campaign run FILE.toml -o {self.path}")

    def result_keys(self) -> set[str]:
        """Keys of all results in the folder."""
        return {path.stem for path in (self.path / CASES).glob("*/*.h5")}

    def note_start(self, key: str) -> None:
        """Note in the journal that a case is handed out."""
        self._note({"event": STARTED, "key": key})

    def note_end(self, outcome: CaseOutcome) -> None:
        """Note in the journal how a case ended."""
        self._note({"event": ENDED, **json_object(outcome)})

    def journal(self) -> Iterator[dict[str, Any]]:
        """The journal's entries, oldest first."""
        try:
            stream = (self.path / JOURNAL).open(encoding="utf-8", errors="replace")
        except OSError:
            return
        with stream:
            for line in stream:
                try:
                    entry = json.loads(line)
                except ValueError:
                    continue  # incomplete: its writer was killed
                if isinstance(entry, dict) and "event" in entry and "key" in entry:
                    yield entry

    def _note(self, entry: dict[str, Any]) -> None:
        """Append a line. One that cannot be written is dropped: a full disk must not end the campaign."""
        stamp = {"at_utc": datetime.now(UTC).isoformat(timespec="milliseconds")}
        line = "\n" + json.dumps(json_value(entry | stamp))  # an incomplete line before it does not spoil this one
        try:
            with (self.path / JOURNAL).open("a", encoding="utf-8") as stream:
                stream.write(line)
        except OSError:
            return


def unfinished(journal: Iterable[dict[str, Any]]) -> set[str]:
    """Keys of the cases that were started and did not end: what was running when a campaign was killed."""
    running: set[str] = set()
    for entry in journal:
        (running.add if entry["event"] == STARTED else running.discard)(entry["key"])
    return running
