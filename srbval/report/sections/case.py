"""Report of a validation case: answer, fault frequencies (as in the paper's Table 6), figures, levels, limitations."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from srbval.bearing import Fault
from srbval.comparison.comparison import Row, Verdict
from srbval.report.blocks import (
    REPORT_SCHEMA,
    Badge,
    Block,
    FigureGrid,
    Heading,
    Listing,
    Report,
    Section,
    VerdictBox,
)
from srbval.report.figures.style import panel
from srbval.report.findings.provenance import provenance
from srbval.report.plain import literal
from srbval.report.prose import Prose
from srbval.report.sections.answer import VERDICT_TONES, worst_tone
from srbval.report.sections.assemble import provenance_section
from srbval.report.sections.figures import PAIR_TEXTS, draw_errors
from srbval.report.sections.table6 import SPEED_TEXTS, TABLE6_TEXTS
from srbval.validation.case import ValidationCase
from srbval.validation.validate import SIDES, Validation

if TYPE_CHECKING:
    import pandas as pd

CASE_TEXTS = Prose("srbval.report", "texts/case.md")
FAR_SPEED_SHARE = 0.05  # relative difference of shaft speeds above which the operating points differ
MAX_DRAWN_PAIRS = 40  # pairs whose figures are drawn; all are in the tables


def assemble_case(result: Validation, grids: Mapping[int, tuple[FigureGrid, ...]], *, command: str) -> Report:
    """Build the report of a validation; `grids` are figures by pair number, `command` repeats the validation."""
    case, table = result.case, result.table
    origin = {"command": command, **provenance((), ())}
    bias = _table_section("bias", [row for row in result.bias if row["records"] > 1])
    sections = [_frequencies(table), _speed(result), _figures(result, grids), _levels(table), bias, _published(case)]
    sections += [
        _table_section("signals", list(_signal_rows(result.pairs.to_dict("records")))),
        CASE_TEXTS.section(Listing(tuple(limits_of(result)))),
        provenance_section(origin),
    ]
    return Report(
        title=case.title,
        subtitle=case.known_bearing.title,
        verdict=_verdict(result),
        sections=tuple(section for section in sections if section is not None),
        data={"schema_version": REPORT_SCHEMA, "status": "incomplete" if result.failed else "ok"}
        | result.to_dict()
        | {"provenance": origin},
        rows={"rows-table": table.to_dict("records"), "rows-pairs": result.pairs.to_dict("records")},
    )


def _verdict(result: Validation) -> VerdictBox:
    rows = result.errors_pct
    listed = ", ".join(f"{row['quantity']} {row['error']:+.3f} %" for row in rows[:8])
    figure = CASE_TEXTS.figure("errors", panel(draw_errors)(rows), wide=False, listed=listed) if rows else None
    points = [
        f"**{row['state']}**: {CASE_TEXTS.text('point-unknown' if row['uncertainty'] is None else 'point', **row)}"
        for row in rows
        if row["quantity"] != "cage ratio"
    ][:6]
    tone, headline = worst_tone(result.verdicts), literal(result.headline)
    return VerdictBox(tone=tone, headline=headline, points=tuple(points), figure=figure)


def _table_section(name: str, rows: Sequence[Mapping[str, Any]], *more: Block, open: bool = False) -> Section | None:
    """Make a section of the table `name` with its `rows`, followed by further blocks; None if there are no rows."""
    if not rows:
        return None
    blocks = (CASE_TEXTS.table(name, rows), *more)
    return Section(id=f"case-{name}", title=CASE_TEXTS.text(f"title-{name}"), blocks=blocks, open=open)


def _frequencies(table: "pd.DataFrame") -> Section | None:
    """Make the section with the table of fault frequencies and cage ratios, in the form of the paper's Table 6."""
    rows = table[table["unit"] != "dB"].to_dict("records")
    how_to_read = TABLE6_TEXTS.paragraph("how-to-read")
    return _table_section("frequencies", [_with_deviations(row) for row in rows], how_to_read, open=True)


def _with_deviations(row: Mapping[str, Any]) -> Row:
    """Add to a row of fault frequencies the source of each value and its deviation from pure rolling."""
    found: Row = {**row} | {"verdict_tone": VERDICT_TONES[row["verdict"]]}
    for side, badge in zip(SIDES, (Badge.SIMULATED, Badge.MEASURED), strict=True):
        deviation = row[f"{side}_deviation_pct"]
        found[f"{side}_badge"] = None if row[side] is None else badge
        found[f"{side}_note"] = "" if deviation is None else f"{deviation:+.2f} %"
    return found


def _speed(result: Validation) -> Section | None:
    """Make the section on BPFO + BPFI, which slip does not change; None if neither model nor rig has both lines."""
    if not result.sums:
        return None
    rollers = result.case.known_bearing.rolling_elements
    rows = [one | {"source_badge": one["origin"], "total_ci95": one["ci95"]} for one in result.sums]
    intro = SPEED_TEXTS.paragraph("intro", rollers=rollers)
    return SPEED_TEXTS.section(intro, SPEED_TEXTS.table("sum-rule-table", rows, rollers=rollers))


def _figures(result: Validation, grids: Mapping[int, tuple[FigureGrid, ...]]) -> Section | None:
    blocks: list[Block] = [PAIR_TEXTS.paragraph("intro")]
    for pair in result.pairs.to_dict("records"):
        if pair["pair"] in grids:
            blocks += [Heading(f"Pair {pair['pair']}: {Fault(pair['state']).label}"), *grids[pair["pair"]]]
    if len(grids) < len(result.pairs):
        blocks.append(PAIR_TEXTS.paragraph("more", drawn=len(grids), pairs=len(result.pairs)))
    return PAIR_TEXTS.section(*blocks) if grids else None


def _levels(table: "pd.DataFrame") -> Section | None:
    levels = table[table["unit"] == "dB"]
    shown = levels.assign(verdict_tone=levels["verdict"].map(VERDICT_TONES))
    return _table_section("levels", shown.to_dict("records"))


def _published(case: ValidationCase) -> Section | None:
    rows = [
        vars(one)
        | {"defect": f"{one.state.code} ({one.state.line})"}
        | {f"{name}_note": f"{deviation:+.2f} %" for name, deviation in one.deviations_pct().items()}
        for one in case.published
    ]
    return _table_section("published", rows)


def _signal_rows(pairs: Sequence[Mapping[str, Any]]) -> Iterator[Row]:
    for pair in pairs:
        for side in SIDES:
            if (facts := pair[f"{side}_facts"]) is None:
                continue
            names = [Path(name).name for name in pair[side]]
            yield {
                "pair": pair["pair"],
                "file": names[0] + (f" and {len(names) - 1} more" if len(names) > 1 else ""),
                "file_badge": facts["origin"],
                "fs_hz": facts["fs_hz"],
                "seconds": facts["seconds"],
                "shaft_rpm": 60 * pair["shaft_hz"][side],
                "shaft_from": facts["shaft_from"],
                "band": "{:g} to {:g}".format(*facts["band_hz"]),
                "how": pair["how"],
            }


def limits_of(result: Validation) -> Iterator[str]:
    """List the limitations of a validation, each with its reason."""
    pairs, verdicts = result.pairs.to_dict("records"), result.verdicts
    if Verdict.INSUFFICIENT in verdicts:
        yield CASE_TEXTS.text("insufficient", count=verdicts[Verdict.INSUFFICIENT])
    apart = [p["pair"] for p in pairs if p["compared_in"] == "orders"]
    if apart:
        yield CASE_TEXTS.text("orders", pairs=", ".join(map(str, apart)))
    if far := [p["pair"] for p in pairs if _apart(p) > FAR_SPEED_SHARE]:
        yield CASE_TEXTS.text("far-apart", pairs=", ".join(map(str, far)), share_pct=100 * FAR_SPEED_SHARE)
    for one in result.failed:
        yield CASE_TEXTS.text("failed", pair=one["pair"], reason=one["reason"])
    cautions = [c for p in pairs for side in SIDES for c in (p[f"{side}_facts"] or {}).get("cautions", ())]
    yield from map(literal, dict.fromkeys(cautions))
    if result.case.tolerance.cage_pct is None and result.case.tolerance.level_db is None:
        yield CASE_TEXTS.text("no-tolerance")
    yield CASE_TEXTS.text("one-mounting")


def _apart(pair: Mapping[str, Any]) -> float:
    speeds = [hz for hz in pair["shaft_hz"].values() if hz]
    return abs(speeds[0] / speeds[1] - 1) if len(speeds) > 1 else 0.0
