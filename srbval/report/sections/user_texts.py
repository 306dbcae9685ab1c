"""Sentences that state the findings in the report on a user's recordings."""

from collections.abc import Iterator, Sequence

from srbval.diagnosis.baseline import Baseline
from srbval.diagnosis.fault_posterior import LABELS
from srbval.reading.lines import Line, NotDetected
from srbval.recordings import SpeedSource
from srbval.report.blocks import ReportRow
from srbval.report.findings.user_records import UserRecord
from srbval.report.plain import literal
from srbval.report.prose import Prose

USER_TEXTS = Prose("srbval.report", "texts/user_report.md")
MIN_PROBABILITY = 0.005  # probabilities below this one are not listed
MAX_NAMES = 6  # recordings that a point lists by name


def headline_of_all(summaries: Sequence[ReportRow]) -> str:
    """State how many of several recordings have a named fault, are undecided, or show no fault."""
    named, undecided, clear = (sum(row["alarm"] == alarm for row in summaries) for alarm in ("yes", "check", "no"))
    counts = {"records": len(summaries), "named": named, "undecided": undecided, "clear": clear}
    if named:
        return USER_TEXTS.text("headline-named", **counts) + (f"; {undecided} undecided" if undecided else "")
    name = "check" if undecided else "nothing" if clear else "none"
    return USER_TEXTS.text(f"headline-{name}", **counts)


def points_of_all(summaries: Sequence[ReportRow], failed: int) -> Iterator[str]:
    """List the recordings with a named fault, the undecided recordings, and the number of unreadable files."""
    for title, alarm in (("Named", "yes"), ("Undecided", "check")):
        rows = [row for row in summaries if row["alarm"] == alarm]
        shown = [literal(row["name"]) + (f" ({row['state']})" if alarm == "yes" else "") for row in rows[:MAX_NAMES]]
        more = f" and {len(rows) - MAX_NAMES} more" if len(rows) > MAX_NAMES else ""
        if rows:
            yield f"**{title}:** {', '.join(shown)}{more}."
    if failed:
        yield USER_TEXTS.text("not-in-report", failed=f"{failed} file{'s' if failed > 1 else ''}")


def points_of_one(record: UserRecord) -> Iterator[str]:
    """List the points on one recording: comparison with the healthy record, summary, probabilities, and cautions."""
    verdict, analysis = record.verdict, record.analysis
    if first := verdict.comparison.sentence or (verdict.reasons[0] if verdict.diagnosis else ""):
        yield literal(first)
    yield literal(analysis.summary)
    shares = verdict.diagnosis.probabilities if verdict.diagnosis else {}
    listed = [
        f"{LABELS[name]} {100 * share:.0f} %"
        for name, share in sorted(shares.items(), key=lambda one: -one[1])
        if share >= MIN_PROBABILITY
    ]
    parts = [f"Probabilities: {', '.join(listed)}."] if listed else []
    parts += [USER_TEXTS.text("caution", caution=caution) for caution in analysis.recording.cautions]
    if parts:
        yield " ".join(parts)


def unseen_reason(line: Line, **limits: float) -> str:
    """State why a line is not detected; `limits` are the highest usable frequency and the lowest detectable SNR."""
    why = line.not_detected or NotDetected.OWN
    name = "flank" if why is NotDetected.OWN else why.name.lower().replace("_", "-")
    if why is NotDetected.HIDDEN and line.snr:
        name += "-snr"
    return USER_TEXTS.text(name, line=line, **limits)


def baseline_items(record: UserRecord, baseline: Baseline) -> Iterator[str]:
    """Name the healthy record used for comparison, the result, and the reasons to doubt the comparison."""
    yield USER_TEXTS.text("healthy", name=baseline.analysis.recording.name)
    if record.verdict.comparison.sentence:
        yield literal(record.verdict.comparison.sentence)
    if not baseline.conditions:
        yield USER_TEXTS.text("same-conditions")
    if baseline.remarks:
        yield literal(" ".join(f"{remark[0].upper()}{remark[1:]}." for remark in baseline.remarks))
    if cautions := baseline.analysis.recording.cautions:
        yield " ".join(USER_TEXTS.text("caution", caution=caution) for caution in cautions)


def limit_items(records: Sequence[UserRecord]) -> Iterator[str]:
    """List the limitations of the report on these records."""
    yield from USER_TEXTS.items("limits")
    if not any(record.baseline for record in records):
        yield USER_TEXTS.text("no-healthy")
    if any(record.analysis.band.trials > 1 for record in records):
        yield USER_TEXTS.text("band-chosen")
    if any(record.analysis.speed.source is SpeedSource.NOMINAL for record in records):
        yield USER_TEXTS.text("speed-nominal")
