"""The answer in plain words, first on the page."""

from __future__ import annotations

from srbval.evidence.gather import Evidence
from srbval.report.badges import Tone
from srbval.report.content.names import FETCH_COMMAND
from srbval.report.model import VerdictBox
from srbval.validation.comparison import ComparisonVerdict
from srbval.validation.table6 import RigSource, Table6Row

# The paper's own largest deviation of its model from kinematics is 0.22 %; this leaves it its rounding.
TABLE6_LIMIT_PCT = 0.25


def verdict_box(evidence: Evidence) -> VerdictBox:
    """Headline and points, all from the comparisons; stand-ins take no part."""
    published = [r for r in evidence.rows if r.rig_source is RigSource.PUBLISHED]
    measured = [r for r in evidence.rows if r.rig_source is RigSource.MEASURED]
    within = all(abs(r.model_deviation_pct) <= TABLE6_LIMIT_PCT for r in published)
    headline = (
        f"The model's race lines lie {'within' if within else 'not within'} {TABLE6_LIMIT_PCT} % of the paper's "
        "kinematic "
        f"frequencies ({_list(published, [r.model_deviation_pct for r in published])})."
    )
    points = [_words(), *_measured_points(measured), *_sum_points(evidence), _limits()]
    tone = Tone.BAD if not within else Tone.GOOD if measured else Tone.WARNING
    return VerdictBox(tone=tone, headline=headline, points=tuple(points))


def _measured_points(rows: list[Table6Row]) -> list[str]:
    if not rows:
        return [
            "**No measured recording took part.** The rig panels show a synthetic stand-in and enter no verdict; "
            f"`{FETCH_COMMAND}` brings real recordings of this rig."
        ]
    resolved = [r.line.name for r in rows if r.comparison.verdict is ComparisonVerdict.RESOLVED]
    said = (
        f"resolved for {' and '.join(resolved)}: the model's error stands out of the uncertainty"
        if resolved
        else "not resolved: it is no larger than the validation uncertainty "
        f"({', '.join(f'{r.line.name} {r.comparison.uncertainty:.2f} %' for r in rows)})"
    )
    return [
        f"Against the rig's **measured** recordings, at their tachometer speed, the model is off by "
        f"{_list(rows, [r.comparison.error for r in rows])}; {said}."
    ]


def _sum_points(evidence: Evidence) -> list[str]:
    paper = next(s for s in evidence.sums if s.source == "paper's rig")
    text = (
        f"The paper's rig lines add up to {paper.difference_pct:+.2f} % of {paper.rolling_elements} shaft orders: a "
        f"shaft at {paper.implied_rpm:.1f} rpm instead of {paper.stated_rpm:g}. Slippage would move each line the "
        "other way."
    )
    measured = [s for s in evidence.sums if s.origin == "measured"]
    if measured:
        total, ci95 = measured[0].total, measured[0].ci95
        text += f" With the speed measured, the rig's recordings add up to {total:.3f} ± {ci95:.3f}."
    return [text]


def _words() -> str:
    return (
        "A defect betrays itself by how often rollers strike it: at **BPFO** on the outer race, at **BPFI** on the "
        "inner one. Kinematics says how often that is when everything rolls; model, paper and rig are held against it."
    )


def _limits() -> str:
    return "What is compared is where the fault lines lie, not how strong they are: amplitudes are not validated here."


def _list(rows: list[Table6Row], values_pct: list[float]) -> str:
    return ", ".join(f"{row.line.name} {value:+.2f} %" for row, value in zip(rows, values_pct, strict=True))
