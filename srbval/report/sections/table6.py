"""Sections on the model's errors: BPFO, BPFI and their sum (Table 6 of Giraudo et al. 2025), cage speed and levels."""

from collections.abc import Mapping, Sequence
from typing import Any

from srbval.bearing import Fault
from srbval.comparison.comparison import TOLERANCE, VERDICT
from srbval.report.blocks import Section
from srbval.report.figures.style import BLUE, GREEN, INK, VERMILION, Panel, PanelData, new_figure
from srbval.report.findings.findings import Findings
from srbval.report.pages import origin_line, record_words
from srbval.report.prose import Prose
from srbval.report.sections.answer import VERDICT_TONES

TABLE6_TEXTS, SPEED_TEXTS, NEAR_TEXTS = (
    Prose("srbval.report", f"texts/{name}.md") for name in ("table6", "speed_or_slip", "near")
)
RATIO_LOOK = {"ms": 5.5, "mew": 1.2, "elinewidth": 1.4, "capsize": 3.5, "zorder": 5}
CLOSED = {True: "yes", False: "no", None: "no interval"}
SCENE_LOOKS = {"paper": ("paper's scene", BLUE, "///"), "rig": ("scene rig", GREEN, "")}


def table6_section(findings: Findings) -> Section:
    """Make the section on errors of BPFO and BPFI at the rig's speed, their uncertainty, and the sums of both lines."""
    measured, badges = [], {"model_hz_badge": "simulated", "rig_hz_badge": "measured"}
    for row in (row for row in findings.data["table6"] if row["rig_source"] == "measured"):
        own = {"name": f"{Fault(row['defect']).code} ({row['line']})", "rig_hz_ci95": row["rig_ci95_hz"]}
        measured.append(row | badges | own | {"verdict_tone": VERDICT_TONES[row["verdict"]]})
    sums = [
        row | {"source_badge": row["origin"], "total_ci95": row["ci95"], "closed": CLOSED[row["closed"]]}
        for row in findings.data["closure"]
    ]
    rollers = sums[0]["rolling_elements"]
    of_model = next(row for row in sums if row["origin"] == "simulated")
    return TABLE6_TEXTS.section(
        origin_line(findings.results, "inputs"),
        TABLE6_TEXTS.table("table-6-rig-speed", measured, more_notes=[parts_sentence(measured)]),
        TABLE6_TEXTS.paragraph("how-to-read"),
        SPEED_TEXTS.paragraph("intro", rollers=rollers),
        SPEED_TEXTS.table("sum-rule-table", sums, rollers=rollers, more_notes=[SPEED_TEXTS.text("own", **of_model)]),
    )


def parts_sentence(rows: list[Mapping[str, Any]]) -> str:
    """List the contributions to the uncertainty of each fault line, as 95 % half widths [%]."""
    parts = []
    for row in rows:
        each = (f"{name.split(':')[0]} {pct:.3f}" for name, pct in row["uncertainty_parts_pct"].items())
        parts.append(f"{row['line']} {', '.join(each)}")
    return TABLE6_TEXTS.text("parts", parts="; ".join(parts))


def near_section(findings: Findings) -> Section:
    """Make the section on the model's errors in cage ratios and vibration levels, with a figure of the cage ratios."""
    data = findings.data
    summaries = (row for row in data["cage_ratios"] if row["of"] != "record")
    values = ", ".join(f"{row['of']} {row['ratio']:.4f} at {row['nominal_rpm']:g} rpm" for row in summaries)
    low, high = data["trend"]["between_records_ci95_pct"]
    return NEAR_TEXTS.section(
        origin_line(findings.results, "inputs"),
        NEAR_TEXTS.table("near-table", map(_near_row, data["near"]), **vars(TOLERANCE), level_db=VERDICT.level_db),
        NEAR_TEXTS.figure("cage-ratios", Panel(draw_cage_ratios, data["cage_ratios"]), wide=False, values=values),
        NEAR_TEXTS.paragraph("trend", trend=trend_sentence(data["trend"]), low_pct=low, high_pct=high, **data["trend"]),
    )


def draw_cage_ratios(rows: Sequence[Mapping[str, Any]]) -> PanelData:
    """Plot ratios of cage to shaft speed, one panel for each nominal speed; for `rows` see `cage_ratio_rows`."""
    figure = new_figure((4.8, 3.3))
    speeds = sorted({row["nominal_rpm"] for row in rows})
    panels = figure.subplots(1, len(speeds), sharey=True, squeeze=False)[0]
    shown = {row["state"] for row in rows}
    codes = [fault.code for fault in Fault if fault.code in shown and fault.code]
    for rpm, axes in zip(speeds, panels, strict=True):
        for row in (row for row in rows if row["nominal_rpm"] == rpm):
            _draw_ratio(axes, codes, **row)
        axes.set_xticks(range(len(codes) + 1), labels=[*codes, "mean"])
        axes.set(xlim=(-0.6, len(codes) + 0.6), xlabel=f"Record of the rig, {rpm:g} rpm")
        axes.ticklabel_format(axis="y", useOffset=False)
    panels[0].set_ylabel("Cage speed over shaft speed")
    handles = {label: handle for handle, label in zip(*panels[-1].get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles, loc="outside upper center", ncols=3, frameon=False, columnspacing=1.2)
    return figure, {key: [row[key] for row in rows] for key in rows[0]}


def _draw_ratio(
    axes: Any, codes: Sequence[str], *, of: str, state: str, ratio: float, low: float, high: float, **_: float
) -> None:
    if of == "kinematics":
        axes.axhline(ratio, color=INK, lw=1.2, ls=(0, (5, 2)), label="kinematics")
    elif of in SCENE_LOOKS:
        name, colour, hatch = SCENE_LOOKS[of]
        axes.axhspan(low, high, facecolor=colour, edgecolor=colour, alpha=0.25, lw=0, hatch=hatch)
        axes.axhline(ratio, color=colour, lw=1.4, label=name)
    else:
        place, name = (len(codes), "rig, mean") if of == "mean" else (codes.index(state), "rig, record")
        marker, face = ("D", "white") if of == "mean" else ("s", VERMILION)
        look = {"fmt": marker, "mfc": face, "mec": VERMILION, "ecolor": VERMILION, "label": name}
        axes.errorbar(place, ratio, yerr=[[ratio - low], [high - ratio]], **RATIO_LOOK, **look)


def _near_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """Format for a table the rig's value of a quantity, and the model's error in the scenes `paper` and `rig`."""
    value, half, spec = row["rig"], row["rig_ci95"], "+.2f" if row["unit"] else ".5f"
    rig = None if value is None else f"{value:{spec}} ± {half:{spec.lstrip('+')}} {row['unit']}".strip()
    tones = {f"{name}_tone": VERDICT_TONES.get(row.get(f"{name}_note", "")) for name in ("paper_error", "rig_error")}
    own = {"record": record_words(row.get("record", "")) or "all", "rig": rig, "rig_ci95": None}
    return {"paper_error": None, "rig_error": None} | dict(row) | own | tones


def trend_sentence(trend: Mapping[str, Any]) -> str:
    """State the change of the rig's cage ratio with speed, and compare it with the model's change if known."""
    if trend["model_pct"] is None:
        return NEAR_TEXTS.text("trend-rig", **trend)
    differs = abs(trend["rig_pct"] - trend["model_pct"]) > trend["u_pct"]
    return NEAR_TEXTS.text("trend-differs" if differs else "trend-alike", **trend)
