"""How often faults were named correctly, by every method, and whether the probabilities hold; as last stored."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from srbval.report.blocks import Block
from srbval.report.figures.style import BLUE, INK, SOFT, Drawn, new_axes, panel
from srbval.report.pages import appendix_page
from srbval.report.section_texts import Texts


def blocks(texts: Texts, content: Mapping[str, Any]) -> Iterator[Block]:
    """Counts by method, by set, class and bearing; the reliability diagram of the probabilities."""
    rows, found = content["methods"], content["naming"]
    groups: dict[tuple[str, str], dict[str, Any]] = {}
    for row in rows:
        groups.setdefault((row["by"], row["of"]), {})[row["name"]] = row
    whole, *parts = groups.items()
    every, by_group = list(whole[1].values()), [{"by": by, "of": of, "by_name": one} for (by, of), one in parts]
    yield texts.paragraph("naming", rows=every)
    yield texts.table("fault-naming", every)
    yield texts.table("naming-groups", sorted(by_group, key=lambda group: group["by"]), names=list(whole[1]))
    learnt, ships = content["learnt"], content["ships"]
    yield texts.paragraph("learnt", by_source={row["learnt_from"]: row for row in learnt}, ships=ships)
    yield texts.table("naming-learnt", learnt)
    yield texts.paragraph("probabilities", found=found)
    yield texts.figure("naming-reliability", reliability_plot(found["reliability"]), found=found)


@panel
def reliability_plot(rows: Sequence[Mapping[str, Any]]) -> Drawn:
    """The rows of `reliability.reliability` over the diagonal, with their bands.

    The band of a bin is what right probabilities give in 95 % of draws; the number is that of its records.
    """
    said, right, low, high = ([row[key] for row in rows] for key in ("said", "right", "low", "high"))
    figure, axes = new_axes((3.8, 3.6))
    axes.plot([0, 1], [0, 1], color=INK, lw=0.9)
    axes.vlines(said, low, high, color=SOFT, lw=6, alpha=0.35, label="95 % if the probabilities are right")
    axes.plot(said, right, "o", color=BLUE, ms=6, label="found")
    for row in rows:
        at = row["said"], row["right"]
        axes.annotate(f"{row['records']}", at, xytext=(-7, -3), textcoords="offset points", ha="right")
    axes.set(xlim=(0, 1.03), ylim=(0, 1.03), xlabel="Probability said", ylabel="Share that was right")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, frameon=False)
    return figure, {key: [row[key] for row in rows] for key in rows[0]}


PAGE = appendix_page(__package__, 120.1, blocks)
