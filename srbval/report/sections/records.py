"""Which records the report is made of, in which bands they are read, and each side's line in the other side's band."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.reading.analyse import Analysis
from srbval.recordings import Origin
from srbval.report.blocks import Block, Figure, Listing, Paragraph, Section, Tone
from srbval.report.figures.images import kurtogram_panel
from srbval.report.findings.findings import Findings
from srbval.report.findings.records import RecordKurtogram
from srbval.report.section_texts import FETCH_COMMAND, Texts, badge_of, side_of, synthetic_states

TEXTS, BANDS = Texts("records"), Texts("bands")
MOST_NAMED = 20  # files in a list; report.json has all
NAMED_LINES = ("BPFO", "BPFI", "2xBSF")  # of races and rollers
ORIGIN_NAME = {"simulated": "model", "measured": "rig", "stand-in": "stand-in"}
TOP_HZ = 10_240.0  # of kurtograms: both sides to the rig's Nyquist frequency


def records_section(findings: Findings) -> Section:
    """One row per record; a warning where the rig side is synthetic."""
    rig = findings.analyses["rig"]
    synthetic = synthetic_states(rig)
    warning = TEXTS.callout("synthetic", tone=Tone.WARNING, synthetic=synthetic, fetch_command=FETCH_COMMAND)
    return TEXTS.section(
        *((warning,) if synthetic else ()),
        TEXTS.paragraph(
            "kinds",
            runs=len(findings.runs),
            states=len(rig),
            measured=sum(a.recording.origin is Origin.MEASURED for a in rig.values()),
            synthetic=synthetic,
        ),
        *_problems(findings),
        TEXTS.table("records", _rows(findings)),
        appendix=(TEXTS.paragraph("chain"), TEXTS.table("lines-found", _rows(findings))),
    )


def _problems(findings: Findings) -> Iterator[Block]:
    """What of the registered data is not used, and what is used with a caution; nothing where all is well."""
    if findings.data["register_unreadable"]:
        yield TEXTS.callout("unreadable", tone=Tone.WARNING, why=findings.data["register_unreadable"])
    for name, rows in (("not-used", findings.data["recordings_not_used"]), ("cautions", findings.data["cautions"])):
        if rows:
            yield TEXTS.callout(name, tone=Tone.WARNING, count=len(rows), files=len({row["file"] for row in rows}))
            shown = (TEXTS.text(f"{name}-row", row=row) for row in rows[:MOST_NAMED])
            more = (TEXTS.text("more", more=len(rows) - MOST_NAMED),) if len(rows) > MOST_NAMED else ()
            yield Listing((*shown, *more))


def _rows(findings: Findings) -> Iterator[dict[str, Any]]:
    at_rig = [findings.analyses["model"][state] for state in findings.measured]
    paper, rig = (findings.analyses[side].values() for side in ("paper", "rig"))
    groups = {"paper's speed": paper, "at the rig's speed": at_rig, "rig side": rig}
    for group, analysis in ((group, analysis) for group, side in groups.items() for analysis in side):
        recording, shown = analysis.recording, analysis.processed
        low, high = shown.band_hz
        lines = [line for line in analysis.lines if line.detected and line.harmonic == 1 and line.name in NAMED_LINES]
        yield {
            "name": Path(recording.file).name if recording.file else "model run",
            "badge": badge_of(analysis),
            "group": group,
            "state": recording.state.label if recording.state else "not stated",
            "speed": analysis.speed,
            "seconds": recording.seconds,
            "band": f"{low:g} to {high:g}, {shown.band_filter.value}{', tracked' if shown.tracking.used else ''}",
            "lines": "; ".join(
                f"{line.name} {line.found_hz:.2f} Hz ({line.deviation_pct:+.2f} %)"
                for line in sorted(lines, key=lambda line: -(line.snr or 0))
            )
            or "no race or roller line",
        }


def band_section(findings: Findings) -> Section:
    """Kurtograms with the bands used, records that hold two combs, and the table of crossed bands."""
    panels = [_kurtogram(letter, shown) for letter, shown in zip("abcd", findings.kurtograms, strict=True)]
    chains = {"model_chain": findings.analyses["paper"][Fault.OUTER].processed.chain,
              "rig_chain": findings.analyses["rig"][Fault.OUTER].processed.chain}  # fmt: skip
    crossed = findings.data["crossed_bands"]
    return BANDS.section(
        appendix=(
            BANDS.paragraph("intro", **chains),
            BANDS.grid("grid", panels, "Kurtograms"),
            *(remark for shown in findings.kurtograms for remark in two_combs(shown)),
            BANDS.table("crossed-bands", crossed),
            BANDS.paragraph("crossed", sides=list(_crossed_sides(crossed))),
        )
    )


def two_combs(shown: RecordKurtogram) -> Iterator[Paragraph]:
    """Says so where a record's most impulsive band shows its line at another frequency than the band used."""
    if shown.second_comb is not None:
        ours, theirs = (_comb(analysis, shown.line) for analysis in (shown.analysis, shown.second_comb))
        state = shown.analysis.recording.state
        yield BANDS.paragraph("two-combs", state=state, line=shown.line, ours=ours, theirs=theirs)


def _comb(analysis: Analysis, name: str) -> str:
    """The line in orders with its interval, its band, and its further harmonics that show."""
    further = [line for line in analysis.lines if line.name == name and line.harmonic > 1 and line.detected]
    return BANDS.text(
        "comb", first=analysis.line(name), further=further, shaft_hz=analysis.speed.value_hz,
        band_hz=analysis.processed.band_hz,
    )  # fmt: skip


def _kurtogram(letter: str, shown: RecordKurtogram) -> Figure:
    analysis = shown.analysis
    state = Fault(analysis.recording.state or Fault.HEALTHY)
    plot = kurtogram_panel(shown, letter=letter, title=state.label, top_hz=TOP_HZ)
    return BANDS.figure(
        "kurtogram", plot, id=f"kurtogram-{letter}", badge=badge_of(analysis), letter=letter, side=side_of(analysis),
        state=state, band_hz=analysis.processed.band_hz, picture=shown.kurtogram,
    )  # fmt: skip


def _crossed_sides(rows: tuple[dict[str, Any], ...]) -> Iterator[tuple[str, list[str], list[str]]]:
    """Each side, the lines that the other side's band still shows, and those that it does not."""
    for origin in dict.fromkeys(row["origin"] for row in rows):
        other = [row for row in rows if row["origin"] == origin and not row["own"]]
        if other:
            found, lost = ([row["line"] for row in other if row["detected"] is shown] for shown in (True, False))
            yield ORIGIN_NAME[origin], found, lost
