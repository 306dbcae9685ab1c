"""Report of a validation case: answer, fault frequencies (as in the paper's Table 6), figures, levels, limitations."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from srbval.bearing import Fault
from srbval.comparison.comparison import Row, Verdict
from srbval.comparison.table6 import Published
from srbval.report.blocks import REPORT_SCHEMA, Block, Heading, Listing, Report, ReportTable, Section, VerdictBox
from srbval.report.figures.style import Panel
from srbval.report.prose import Prose, literal
from srbval.report.sections.answer import VERDICT_TONES, worst_tone
from srbval.report.sections.assemble import provenance_section
from srbval.report.sections.figures import PAIR_TEXTS, draw_errors
from srbval.report.sections.table6 import SPEED_TEXTS, TABLE6_TEXTS
from srbval.validation.validate import SIDES, Validation

CASE_TEXTS = Prose("srbval.report", "texts/case.md")
MAX_DRAWN_PAIRS = 40  # pairs whose figures are drawn; all are in the tables


def assemble_case(result: Validation, grids: Mapping[int, tuple[Block, ...]], origin: Mapping[str, Any]) -> Report:
    """Build the report of a validation; `grids` are figures by pair number; for `origin` see `assemble_trend`."""
    case, table, rows = result.case, result.table, result.errors_pct
    listed = ", ".join(f"{row['quantity']} {row['error']:+.3f} %" for row in rows[:8])
    picture = CASE_TEXTS.figure("errors", Panel(draw_errors, rows), wide=False, listed=listed) if rows else None
    shown, levels = frequency_table(table), table[table["unit"] == "dB"]
    levels = levels.assign(verdict_tone=levels["verdict"].map(VERDICT_TONES))
    lines = (shown, TABLE6_TEXTS.paragraph("how-to-read")) if shown.rows else ()
    rollers = case.known_bearing.rolling_elements
    sums = [one | {"source_badge": one["origin"], "total_ci95": one["ci95"]} for one in result.sums]
    # Slip does not change BPFO + BPFI; the section is empty if neither model nor rig has both lines.
    speed = SPEED_TEXTS.paragraph("intro", rollers=rollers), SPEED_TEXTS.table("sum-rule-table", sums, rollers=rollers)
    return Report(
        title=case.title,
        subtitle=case.known_bearing.title,
        verdict=VerdictBox(tone=worst_tone(result.verdicts), headline=literal(result.headline), figure=picture),
        sections=(  # a section without blocks is not shown
            Section(id="case-frequencies", title=CASE_TEXTS.text("title-frequencies"), blocks=lines, open=True),
            SPEED_TEXTS.section(*(speed if sums else ())),
            _figures(result, grids),
            _table_section("levels", levels.to_dict("records")),
            _table_section("bias", [row for row in result.bias if row["records"] > 1]),
            _table_section("published", [_published_row(one) for one in case.published]),
            _table_section("signals", list(_signal_rows(result.pairs.to_dict("records")))),
            CASE_TEXTS.section(Listing(tuple(limits_of(result)))),
            provenance_section(origin),
        ),
        data={"schema_version": REPORT_SCHEMA, "status": "incomplete" if result.failed else "ok"}
        | result.to_dict()
        | {"provenance": origin},
    )


def _table_section(name: str, rows: Sequence[Mapping[str, Any]]) -> Section:
    blocks = (CASE_TEXTS.table(name, rows),) if rows else ()
    return Section(id=f"case-{name}", title=CASE_TEXTS.text(f"title-{name}"), blocks=blocks)


def frequency_table(table: pd.DataFrame, id: str = "frequencies") -> ReportTable:
    """Make the table of fault frequencies and cage ratios, in the form of the paper's Table 6.

    Each value has its source and its deviation from pure rolling.
    """
    rows, columns = table[table["unit"] != "dB"], CASE_TEXTS.columns("frequencies")
    shown = rows.assign(verdict_tone=rows["verdict"].map(VERDICT_TONES))
    for side in SIDES:
        notes = [None if pct is None else f"{pct:+.2f} %" for pct in rows[f"{side}_deviation_pct"]]
        shown[f"{side}_note"], shown[f"{side}_badge"] = notes, [value and side for value in rows[side]]
    if table["pair"].nunique() == 1:
        del columns["pair"]
    return CASE_TEXTS.table("frequencies", shown, columns, id=id)


def _figures(result: Validation, grids: Mapping[int, tuple[Block, ...]]) -> Section:
    blocks: list[Block] = [PAIR_TEXTS.paragraph("intro")] if grids else []
    for pair in result.pairs.to_dict("records"):
        if pair["pair"] in grids:
            blocks += [Heading(f"Pair {pair['pair']}: {Fault(pair['state']).label}"), *grids[pair["pair"]]]
    if len(grids) < len(result.pairs):
        blocks.append(PAIR_TEXTS.paragraph("more", drawn=len(grids), pairs=len(result.pairs)))
    return PAIR_TEXTS.section(*blocks)


def _published_row(one: Published) -> Row:
    notes = {f"{name}_note": f"{deviation:+.2f} %" for name, deviation in one.deviations_pct().items()}
    return vars(one) | {"defect": f"{one.state.code} ({one.state.line})"} | notes


def _signal_rows(pairs: Sequence[Mapping[str, Any]]) -> Iterator[Row]:
    for pair in pairs:
        for side in SIDES:
            if (facts := pair[f"{side}_facts"]) is None:
                continue
            names = [Path(name).name for name in pair[side]]
            file = names[0] + (f" and {len(names) - 1} more" if len(names) > 1 else "")
            own = {"pair": pair["pair"], "how": pair["how"], "file": file, "file_badge": facts["origin"]}
            own |= {"shaft_rpm": 60 * pair["shaft_hz"][side], "band": "{:g} to {:g}".format(*facts["band_hz"])}
            yield facts | own


def limits_of(result: Validation) -> Iterator[str]:
    """List the limitations of a validation, each with its reason."""
    pairs, verdicts = result.pairs.to_dict("records"), result.verdicts
    if Verdict.INSUFFICIENT in verdicts:
        yield CASE_TEXTS.text("insufficient", count=verdicts[Verdict.INSUFFICIENT])
    if apart := [p["pair"] for p in pairs if p["compared_in"] == "orders"]:
        yield CASE_TEXTS.text("orders", pairs=", ".join(map(str, apart)))
    for one in result.failed:
        yield CASE_TEXTS.text("failed", pair=one["pair"], reason=one["reason"])
    cautions = [c for p in pairs for side in SIDES for c in (p[f"{side}_facts"] or {}).get("cautions", ())]
    yield from map(literal, dict.fromkeys(cautions))
    yield CASE_TEXTS.text("one-mounting")
