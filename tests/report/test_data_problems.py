"""Registered recordings that vanished or changed, and those used with a caution, are named where the data are told."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

from srbval.recordings.registry import FileStatus, RegisteredRecording
from srbval.report.blocks import Callout, Listing
from srbval.report.findings.findings import Evidence
from srbval.report.reports import MadeReport
from srbval.report.section_texts import Texts
from srbval.report.sections.records import MOST_NAMED, records_section
from srbval.storage.json_files import to_json


def missing(number: int) -> RegisteredRecording:
    return RegisteredRecording(
        file=f"/data/{number}.mat", sha256="", size_bytes=0, mtime_ns=0, status=FileStatus.MISSING,
        reason="the file is no longer there",
    )  # fmt: skip


def shown(evidence: Evidence) -> tuple[list[str], list[str]]:
    """Titles of the boxed remarks and items of the lists, but for what every report has."""
    blocks = records_section(evidence).blocks
    titles = [b.title for b in blocks if isinstance(b, Callout)]
    items = [item for b in blocks if isinstance(b, Listing) for item in b.items]
    usual = Texts("records").callout("synthetic", tone=blocks[0].tone, synthetic=[], fetch_command="").title  # type: ignore[union-attr]
    return [t for t in titles if t != usual], [i for i in items if not i.startswith(("**simulated", "**measured",
                                                "**published", "**stand-in"))]  # fmt: skip


def test_nothing_is_said_where_all_is_well(alone: tuple[MadeReport, Path]) -> None:
    found = json.loads(alone[0].files["json"].read_text(encoding="utf-8"))
    assert (found["recordings_not_used"], found["register_unreadable"], found["cautions"]) == ([], None, [])
    assert shown(alone[0].evidence) == ([], [])


def test_what_vanished_is_named_and_counted(alone: tuple[MadeReport, Path]) -> None:
    evidence = alone[0].evidence
    recordings = (*evidence.register.recordings, *map(missing, range(MOST_NAMED + 3)))
    evidence = dataclasses.replace(evidence, register=dataclasses.replace(evidence.register, recordings=recordings))
    titles, items = shown(evidence)
    assert titles == [f"Registered recordings that are not used: {MOST_NAMED + 3}"]
    assert items[0] == "**0.mat**: missing; the file is no longer there"
    assert len(items) == MOST_NAMED + 1
    assert items[-1].startswith("3 more")
    said = to_json(evidence.to_dict())["recordings_not_used"]
    assert len(said) == MOST_NAMED + 3
    assert said[1] == {"file": "1.mat", "status": "missing", "reason": "the file is no longer there"}


def test_an_unreadable_register_is_said(alone: tuple[MadeReport, Path]) -> None:
    register = dataclasses.replace(alone[0].evidence.register, unreadable="manifest.json: not a manifest of srbval")
    evidence = dataclasses.replace(alone[0].evidence, register=register)
    assert shown(evidence) == (["The register of recordings cannot be read"], [])
    assert to_json(evidence.to_dict())["register_unreadable"] == register.unreadable


def test_cautioned_recordings_are_named(alone: tuple[MadeReport, Path]) -> None:
    evidence = alone[0].evidence
    record = dataclasses.replace(evidence.other_rigs[0], file="set/a.mat", cautions=("clipped: 3 of 9", "held: 5"))
    evidence = dataclasses.replace(evidence, other_rigs=(record, record))
    titles, items = shown(evidence)
    assert titles == ["Recordings used with a caution: 1"]
    assert items == ["**a.mat**: clipped: 3 of 9", "**a.mat**: held: 5"]
    assert to_json(evidence.to_dict())["cautions"] == [
        {"file": "a.mat", "caution": "clipped: 3 of 9"}, {"file": "a.mat", "caution": "held: 5"}
    ]  # fmt: skip


def test_hostile_names_of_them(hostile: dict[str, Path]) -> None:
    found = json.loads(hostile["json"].read_bytes())
    assert len(found["recordings_not_used"]) == 1
    assert "Registered recordings that are not used: 1" in hostile["html"].read_text("utf-8")
