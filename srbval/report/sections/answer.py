"""First screen of the main report: headline, Table 6 of Giraudo et al. 2025, small figures, answers of studies."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from srbval import __version__
from srbval.bearing import Fault
from srbval.comparison.comparison import TOLERANCE, VERDICT, Verdict
from srbval.comparison.counterpart import PAPER_STATES
from srbval.report.blocks import Callout, Figure, FigureGrid, ReportRow, ReportTable, Tone, VerdictBox
from srbval.report.figures.signals import draw_thumbnail
from srbval.report.figures.style import Panel
from srbval.report.findings.findings import Findings
from srbval.report.findings.records import peak_amplitude
from srbval.report.pages import record_words
from srbval.report.prose import Prose
from srbval.report.sections.figures import HEAD_ROOM, PAPER_FIGURES, SPECTRUM_HZ, picture_verdict, shared_limits
from srbval.storage.stored_result import StoredResult
from srbval.sweep.scenes import PAPER

ANSWER_TEXTS = Prose("srbval.report", "texts/answer.md")
VERDICT_TONES: dict[str, Tone] = {  # the worst first
    Verdict.MISSED: Tone.BAD,
    Verdict.DIFFERS: Tone.WARNING,
    Verdict.INSUFFICIENT: Tone.NEUTRAL,
    Verdict.NOT_RESOLVED: Tone.NEUTRAL,
    Verdict.MET: Tone.GOOD,
    Verdict.AGREES: Tone.GOOD,
}
SCENE_NAMES = {"paper": "the paper's scene", "rig": "the rig's scene"}
THUMBNAILS = {"11c": Fault.OUTER, "12a": Fault.OUTER, "13a": Fault.INNER, "14c": Fault.OUTER}  # state by panel
OUTCOME = "prediction_outcome"  # stored result with a name of its own


def verdict_box(findings: Findings, data: ReportRow, tiles: Iterable[Callout | None]) -> VerdictBox:
    """Make the first screen of the main report from the findings, the content of ``report.json`` and studies' tiles."""
    judged, shown = data["verdicts"], filter(None, (speed_tile(findings.data["runs"]), *tiles))
    origin = {
        "machine": data["provenance"]["machine"]["processor"],
        "version": __version__,
        "runs": len(findings.data["runs"]),
        "readings": len(data["pairs"]) + len(PAPER_STATES),
        "stored": stored_sentence(findings.results.values()),
        "records": used_sentence(data["comparisons"], data["cage_readings"]),
    }
    return VerdictBox(
        tone=worst_tone(row["verdict"] for row in judged),
        kicker=finding_sentence(judged),
        headline=f"{near_sentence(data)} {missing_sentence(data)}",
        blocks=(_table6(data), *shown, _thumbnails(findings), ANSWER_TEXTS.paragraph("origin", **origin)),
    )


def worst_tone(answers: Iterable[str]) -> Tone:
    """Return the tone (colour and sign) of the worst verdict; a warning if there is no verdict."""
    found = set(answers)
    return next((tone for answer, tone in VERDICT_TONES.items() if answer in found), Tone.WARNING)


def finding_sentence(judged: Sequence[ReportRow]) -> str:
    """State in which scenes and at which speeds the cage ratio misses its tolerance, from the verdicts `judged`."""
    missed = []
    for scene, name in SCENE_NAMES.items():
        own = [row["endpoint"] for row in judged if (row["scene"], row["verdict"]) == (scene, Verdict.MISSED)]
        missed += [f"{name} ({' and '.join(map(endpoint_words, own))})"] if own else []
    name = "finding" if missed else "not-missed" if judged else "not-known"
    return ANSWER_TEXTS.text(name, limit_pct=TOLERANCE.limit_pct, missed=" and in ".join(missed))


def endpoint_words(endpoint: str) -> str:
    """Put the name of a cage ratio, or of its change with speed, in words: "353 rpm" becomes "the ratio at 353 rpm"."""
    later, less, first = endpoint.partition(" less ")
    if less and first.endswith("rpm"):
        return f"the change of the ratio from {first.removesuffix(' rpm')} to {later} rpm"
    return f"the ratio at {endpoint}"


def near_sentence(data: ReportRow) -> str:
    """State the model's errors: in BPFO and BPFI at the rig's measured speed, and in cage speed in the scene `rig`."""
    parts = [
        f"{interval(row['comparison_error_pct'], row['validation_uncertainty_pct'])} "
        f"({Fault(row['defect']).label}, {row['line']}: {row['verdict']})"
        for row in data["table6"]
        if row["rig_source"] == "measured"
    ]
    rig = next((row for row in data["verdicts"] if row["scene"] == "rig"), None)
    more = ANSWER_TEXTS.text("near-rig", **rig, error=interval(rig["error_pct"], rig["u_pct"])) if rig else ""
    return ANSWER_TEXTS.text("near", lines=" and ".join(parts), more=more)


def interval(error: float, u: float | None) -> str:
    """Format an error with its uncertainty, in per cent."""
    return f"{error:+.2f} %, uncertainty unknown" if u is None else f"{error:+.2f} ± {u:.2f} %"


def missing_sentence(data: ReportRow) -> str:
    """List what the model does not reproduce, with numbers: the cage ratio's change with speed, or vibration levels."""
    trend, levels = data["trend"], (data.get("amplitudes") or {}).get("locked")
    found = []
    if trend["verdict"] in (Verdict.MISSED, Verdict.DIFFERS):
        found.append(ANSWER_TEXTS.text("missing-trend", **trend))
    if levels and levels["within"] < levels["of"]:
        found.append(ANSWER_TEXTS.text("missing-levels", **levels, near_db=VERDICT.near_db))
    return ANSWER_TEXTS.text("missing", found=" and ".join(found)) if found else ANSWER_TEXTS.text("nothing-missing")


def _table6(data: ReportRow) -> ReportTable:
    """Make Table 6 of Giraudo et al. 2025, one row per source; deviations from pure rolling are below the values.

    Each item of the text's list of sources has the name of a row, the source of the rig's value and of the row, and the
    keys of line and half width in ``table6``.
    """
    of = {(row["rig_source"], Fault(row["defect"])): row for row in data["table6"]}
    shown = []
    for item in ANSWER_TEXTS.items("sources"):
        name, source, badge, value, ci95 = (part.strip() for part in item.split("|"))
        speeds = [f"{of[source, fault]['shaft_rpm']:.4g}" for fault in (Fault.OUTER, Fault.INNER)]
        at = f"at {' and '.join(dict.fromkeys(speeds))} rpm"
        found: dict[str, Any] = {"source": name, "source_badge": badge, "source_note": at}
        for fault in (Fault.OUTER, Fault.INNER):
            row, half = of[source, fault], of[source, fault].get(ci95)
            found |= {fault.value: row[value], f"{fault}_ci95": half}
            if row[value] is not None and value != "kinematic_hz":
                about = f" ± {100 * half / row['kinematic_hz']:.2f}" if half else ""
                found[f"{fault}_note"] = f"{100 * (row[value] / row['kinematic_hz'] - 1):+.2f}{about} %"
        shown.append(found)
    conclusion = shaft_sentence(data["closure"], of["published", Fault.INNER])
    return ANSWER_TEXTS.table("table-6-sources", shown, more_notes=[conclusion])


def shaft_sentence(sums: Iterable[ReportRow], inner: ReportRow) -> str:
    """State if slip explains the BPFI measured in the paper (`inner`): slip leaves BPFO + BPFI (`sums`) unchanged."""
    row = next(one for one in sums if one["source"] == "paper's rig")
    as_slip = abs(row["difference_pct"]) < TOLERANCE.limit_pct
    speed = "slower" if row["difference_pct"] < 0 else "faster"
    words = {"speed": speed, "printed_pct": inner["paper_rig_printed_pct"], "limit_pct": TOLERANCE.limit_pct}
    return ANSWER_TEXTS.text("as-slip" if as_slip else "other-speed", **row, **words)


def speed_tile(runs: Iterable[ReportRow]) -> Callout:
    """Compare the computing time of a simulated second on this machine with that stated in the paper."""
    run = next(one for one in runs if one["id"] == "paper-outer")
    words = {"steps_per_s": 1 / run["step_s"], "paper_s": PAPER.wall_s / PAPER.simulated_s, "paper": PAPER}
    return ANSWER_TEXTS.callout("speed-tile", tone=Tone.NEUTRAL, **run, **words)


def _thumbnails(findings: Findings) -> FigureGrid:
    """Arrange thumbnails of the paper's Figures 11 to 14, model beside rig; each caption states if both are alike."""
    shown: list[Figure] = []
    for name, state in THUMBNAILS.items():
        kind, sides = PAPER_FIGURES[name[:2]][0], [side[state] for side in findings.views.values()]
        tops = shared_limits(sides) | {"spectrum": HEAD_ROOM * max(peak_amplitude(one, SPECTRUM_HZ) for one in sides)}
        plot = Panel(draw_thumbnail, sides, kind, SPECTRUM_HZ, tops[kind])
        words: dict[str, Any] = {"number": name[:2], "kind": kind, "state": state.label}
        words["alike"] = picture_verdict(findings.data["pictures"], kind, state)
        shown.append(ANSWER_TEXTS.figure("thumbnail", plot, id=f"small-{name}", small_of=f"fig{name}", **words))
    return ANSWER_TEXTS.grid("thumbnails", shown, most=len(shown), pct=VERDICT.share_pct, level_db=VERDICT.level_db)


def stored_sentence(results: Iterable[StoredResult]) -> str:
    """List the stored results by the day and the machine on which they were computed."""
    groups: dict[str, list[str]] = {}
    for one in results:
        where = f"{one.made_utc[:10]}, {one.origin.get('processor') or 'an unknown processor'}"
        name = ANSWER_TEXTS.text(f"stored-{OUTCOME}") if one.path.stem == OUTCOME else one.path.stem.replace("_", " ")
        groups.setdefault(where, []).append(name)
    return "; ".join(f"{', '.join(sorted(names))} ({where})" for where, names in groups.items()) or "nothing"


def used_sentence(comparisons: Sequence[ReportRow], readings: Iterable[Any]) -> str:
    """Name records used to fit the model's levels, and records first read for comparison with it; count others."""
    seen, parts = {Path(one.record).stem for one in readings}, []
    for use in ("fit", "blind"):
        found = {Path(one["record"]).stem for one in comparisons if one["used_for"] == use}
        names = ", ".join(sorted(map(record_words, found)))
        parts.append(ANSWER_TEXTS.text(f"used-{use}" if found else f"no-{use}", records=names))
        seen -= found
    return "; ".join([*parts, ANSWER_TEXTS.text("used-withheld", count=len(seen))])
