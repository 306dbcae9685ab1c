"""The report of a case: its answer, fault frequencies in the form of the paper's Table 6, figures, levels, limits."""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from srbval.bearing import Fault
from srbval.comparison.comparison import Row, deviation_pct
from srbval.comparison.vocabulary import Verdict
from srbval.processes.machine import one_thread
from srbval.progress import Progress, silent, stage
from srbval.report.blocks import Badge, Block, FigureGrid, Heading, Listing, Report, Section, Tone, VerdictBox
from srbval.report.figures.style import figure_style
from srbval.report.findings.provenance import provenance
from srbval.report.plain import literal
from srbval.report.prose import Prose
from srbval.report.renderers import require_typst
from srbval.report.sections.assemble import provenance_section
from srbval.report.sections.pair_figures import errors_panel, pair_figures
from srbval.report.sections.table6 import SPEED, VERDICT_TONE
from srbval.report.sections.table6 import TEXTS as TABLE6
from srbval.report.write import FORMATS, write_report
from srbval.validation.case import Case
from srbval.validation.validate import SIDES, PairReading, Validation, validate

if TYPE_CHECKING:
    import pandas as pd

TEXTS, PAIRS = (Prose("srbval.report", f"texts/{name}.md") for name in ("case", "pairs"))
WIDELY_APART = 0.05  # relative difference of shaft speeds above which the operating points differ
MOST_DRAWN = 40  # pairs whose figures are drawn; all are in the tables
TONES = {
    Verdict.MISSED: Tone.BAD, Verdict.DIFFERS: Tone.WARNING, Verdict.INSUFFICIENT: Tone.NEUTRAL,
    Verdict.NOT_RESOLVED: Tone.NEUTRAL, Verdict.MET: Tone.GOOD, Verdict.AGREES: Tone.GOOD,
}  # the worst first  # fmt: skip
SCHEMA_VERSION = 1


@dataclass(frozen=True, kw_only=True, eq=False)
class ShownValidation(Validation):
    """A `Validation` that shows itself: its errors as a picture, its report as a page."""

    def plot(self) -> Any:
        """Matplotlib figure of the error of every line and cage ratio with its uncertainty."""
        with figure_style():
            return errors_panel.__wrapped__(_in_pct(self))[0]

    def to_html(self) -> str:
        """The whole report as one page; reads the signals again."""
        with tempfile.TemporaryDirectory(prefix="srbval-") as folder:
            _, files = report_case(self.case, Path(folder), formats=("html",))
            return files["html"].read_text(encoding="utf-8")


def validate_case(
    case: Case | str | Path,
    changes: Mapping[str, Any] | None = None,
    *,
    jobs: int | None = None,
    progress: Progress = silent,
) -> ShownValidation:
    """`srbval.validation.validate.validate`, whose result also shows itself."""
    return ShownValidation(**vars(validate(case, changes, jobs=jobs, progress=progress)))


def report_case(
    case: Case,
    folder: Path,
    *,
    formats: tuple[str, ...] = FORMATS,
    command: str = "srbval validate",
    progress: Progress = silent,
) -> tuple[Validation, dict[str, Path]]:
    """Compare every pair of a case and write ``report.*`` and ``figures/`` into `folder`; returns both.

    Raises what `validate` raises, and `DataError` for a folder that cannot be written; nothing is written in that case.
    """
    if "pdf" in formats:
        require_typst()
    grids: dict[int, tuple[FigureGrid, ...]] = {}
    with tempfile.TemporaryDirectory(prefix="srbval-") as name, one_thread():

        def found(one: PairReading) -> None:
            if len(grids) < MOST_DRAWN:
                grids[one.number] = pair_figures(one, Path(name))

        result = validate(case, found=found, progress=progress)
        with stage(progress, "Write the report"):
            files = write_report(assemble_case(result, grids, command=command), folder, formats)
    return result, files


def assemble_case(result: Validation, grids: Mapping[int, tuple[FigureGrid, ...]], *, command: str) -> Report:
    """The report of a validation with the figures of its pairs; `command` is the one that makes it again."""
    case, table = result.case, result.table
    origin = {"command": command, **provenance((), ())}
    sections = [_frequencies(table), _speed(result), _figures(result, grids), _levels(table), _published(case)]
    sections += [_signals(result), TEXTS.section(Listing(tuple(limits_of(result)))), provenance_section(origin)]
    return Report(
        title=case.title,
        subtitle=case.bearing.title,
        generated_utc=datetime.now(UTC),
        verdict=_verdict(result),
        sections=tuple(section for section in sections if section is not None),
        data={"schema_version": SCHEMA_VERSION, "status": "incomplete" if result.failed else "ok"}
        | result.to_dict()
        | {"provenance": origin},
        rows={"rows-table": table.to_dict("records"), "rows-pairs": result.pairs.to_dict("records")},
    )


def _verdict(result: Validation) -> VerdictBox:
    rows = _in_pct(result)
    worst = next((tone for verdict, tone in TONES.items() if verdict in result.verdicts), Tone.WARNING)
    listed = ", ".join(f"{row['quantity']} {row['error']:+.3f} %" for row in rows[:8])
    figure = TEXTS.figure("errors", errors_panel(rows), wide=False, listed=listed) if rows else None
    points = [f"**{row['state']}**: {_point(row)}" for row in rows if row["quantity"] != "cage ratio"][:6]
    return VerdictBox(tone=worst, headline=literal(result.headline), points=tuple(points), figure=figure)


def _in_pct(result: Validation) -> list[Row]:
    rows: list[Row] = result.table[result.table["error_unit"] == "%"].to_dict("records")
    return [row for row in rows if row["error"] is not None]


def _point(row: Mapping[str, Any]) -> str:
    if row["uncertainty"] is None:
        return TEXTS.text("point-unknown", **row)
    return TEXTS.text("point", **row)


def _frequencies(table: "pd.DataFrame") -> Section | None:
    """Lines and cage ratios in the form of the paper's Table 6."""
    rows = [
        _with_deviations(row) for row in table.to_dict("records") if row["error_unit"] != "dB" and row["unit"] != "dB"
    ]
    if not rows:
        return None
    return Section(
        id="fault-frequencies",
        title=TEXTS.text("title-frequencies"),
        blocks=(TEXTS.table("frequencies", rows), TABLE6.paragraph("how-to-read")),
        open=True,
    )


def _with_deviations(row: Mapping[str, Any]) -> Row:
    digits = {f"{side}_note": f"{deviation_pct(row[side], row['kinematic']):+.2f} %" for side in SIDES
              if row[side] is not None and row["kinematic"]}  # fmt: skip
    return {
        **row,
        "simulated_badge": Badge.SIMULATED if row["simulated"] is not None else None,
        "measured_badge": Badge.MEASURED if row["measured"] is not None else None,
        "verdict_tone": VERDICT_TONE.get(row["verdict"], Tone.NEUTRAL),
        "simulated_note": "", "measured_note": "",
    } | digits  # fmt: skip


def _speed(result: Validation) -> Section | None:
    """The sums of both race lines, if a side has both."""
    if not result.sums:
        return None
    rollers = result.case.bearing.rolling_elements
    rows = [
        {name: getattr(one, name) for name in ("source", "bpfo_order", "bpfi_order", "total", "difference_pct",
                                               "stated_rpm", "implied_rpm", "closed")}
        | {"source_badge": one.origin, "total_ci95": one.ci95}
        for one in result.sums
    ]  # fmt: skip
    return SPEED.section(
        SPEED.paragraph("intro", rollers=rollers),
        SPEED.table("sum-rule-table", rows, rollers=rollers),
    )


def _figures(result: Validation, grids: Mapping[int, tuple[FigureGrid, ...]]) -> Section | None:
    blocks: list[Block] = [PAIRS.paragraph("intro")]
    for pair in result.pairs.to_dict("records"):
        if pair["pair"] in grids:
            blocks += [Heading(f"Pair {pair['pair']}: {Fault(pair['state']).label}"), *grids[pair["pair"]]]
    if len(grids) < len(result.pairs):
        blocks.append(PAIRS.paragraph("more", drawn=len(grids), pairs=len(result.pairs)))
    return PAIRS.section(*blocks) if grids else None


def _levels(table: "pd.DataFrame") -> Section | None:
    rows = [
        row | {"verdict_tone": VERDICT_TONE.get(row["verdict"], Tone.NEUTRAL)}
        for row in table[table["unit"] == "dB"].to_dict("records")
    ]
    if not rows:
        return None
    return Section(id="line-levels", title=TEXTS.text("title-levels"), blocks=(TEXTS.table("levels", rows),))


def _published(case: Case) -> Section | None:
    rows = [
        vars(one) | {"defect": f"{one.state.code} ({one.state.line})"}
        | {f"{name}_note": f"{deviation_pct(value, one.kinematic_hz):+.2f} %" for name in ("model_hz", "rig_hz")
           if (value := getattr(one, name)) is not None and one.kinematic_hz}
        for one in case.published
    ]  # fmt: skip
    if not rows:
        return None
    return Section(
        id="published-numbers", title=TEXTS.text("title-published"), blocks=(TEXTS.table("published", rows),)
    )


def _signals(result: Validation) -> Section:
    rows = list(_signal_rows(result.pairs.to_dict("records")))
    return Section(id="signals-compared", title=TEXTS.text("title-signals"), blocks=(TEXTS.table("signals", rows),))


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
    """What the report of this case cannot show, and why."""
    pairs, verdicts = result.pairs.to_dict("records"), result.verdicts
    if Verdict.INSUFFICIENT in verdicts:
        yield TEXTS.text("insufficient", count=verdicts[Verdict.INSUFFICIENT])
    apart = [p["pair"] for p in pairs if p["compared_in"] == "orders"]
    if apart:
        yield TEXTS.text("orders", pairs=", ".join(map(str, apart)))
    if far := [p["pair"] for p in pairs if _apart(p) > WIDELY_APART]:
        yield TEXTS.text("far-apart", pairs=", ".join(map(str, far)), share_pct=100 * WIDELY_APART)
    for one in result.failed:
        yield TEXTS.text("failed", pair=one["pair"], reason=one["reason"])
    cautions = [c for p in pairs for side in SIDES for c in (p[f"{side}_facts"] or {}).get("cautions", ())]
    yield from map(literal, dict.fromkeys(cautions))
    if result.case.tolerance.cage_pct is None and result.case.tolerance.level_db is None:
        yield TEXTS.text("no-tolerance")
    yield TEXTS.text("one-mounting")


def _apart(pair: Mapping[str, Any]) -> float:
    speeds = [hz for hz in pair["shaft_hz"].values() if hz]
    return abs(speeds[0] / speeds[1] - 1) if len(speeds) > 1 else 0.0
