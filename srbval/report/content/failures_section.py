"""What failed or was refused while this report was made, in one place."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from srbval.evidence.gather import Evidence
from srbval.models.run import RunStatus
from srbval.report.badges import Tone
from srbval.report.blocks import Block, Callout, Listing, Paragraph
from srbval.report.inline import literal
from srbval.report.model import Section
from srbval.storage.stored_result import SPEED_ACCURACY, STABILITY, StoredResult
from srbval.validation.matrix import NOT_DETECTED


def failures_section(evidence: Evidence, kept: Mapping[str, StoredResult | None]) -> Section:
    """One line a failure; those of stored results by their number, since their sections name each."""
    items = [*_runs(evidence), *_records(evidence), *_stored(kept)]
    blocks: tuple[Block, ...] = (
        (Paragraph("Nothing below entered a verdict."), Listing(items=tuple(items)))
        if items
        else (Callout(tone=Tone.GOOD, text="No run failed and no record was refused."),)
    )
    return Section(id="failures", title="What failed", blocks=blocks)


def _runs(evidence: Evidence) -> list[str]:
    failed = [(i, r) for i, r in evidence.runs.items() if r.status is not RunStatus.OK]
    told = [f"**Run {i}**: {r.status.value}, {literal(r.reason)}." for i, r in failed]
    return told or [f"**Runs of this report**: none of {len(evidence.runs)} failed."]


def _records(evidence: Evidence) -> list[str]:
    matrix = evidence.matrix
    items = [f"**Rig record not usable**: {literal(f'{Path(f).name}: {why}')}" for f, why in matrix.unusable]
    unread = [c for c in matrix.cells if c.verdict == NOT_DETECTED]
    if unread:
        names = ", ".join(literal(Path(c.file).name) for c in unread)
        items.append(f"**Fault line not detected** in {len(unread)} of {len(matrix.cells)} rig records: {names}.")
    refused = [r for r in evidence.other_rigs if r.refused]
    if refused:
        items.append(
            f"**Records of other rigs not analysed**: {len(refused)} of {len(evidence.other_rigs)}, each with its "
            "reason in that section's table."
        )
    return items


def _stored(kept: Mapping[str, StoredResult | None]) -> list[str]:
    items = []
    if measured := kept.get(SPEED_ACCURACY):
        runs = measured.content["runs"]
        failed = sum(row["status"] != "ok" for row in runs)
        items.append(f"**Stored benchmark**: {failed} of {len(runs)} runs failed, as short explicit methods must.")
    if mapped := kept.get(STABILITY):
        counts = mapped.content["counts"]
        items.append(f"**Stored stability map**: {counts['cells'] - counts['ok']} of {counts['cells']} cells not ok.")
    return items
