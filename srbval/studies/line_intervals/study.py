"""The intervals of slipping and of weak lines: their coverage, and the table of factors that it rests on."""

from argparse import ArgumentParser, Namespace

from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.studies.harness import Study, StudyResult
from srbval.studies.line_intervals import slip, weak


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--table", action="store_true", help="make the table again: srbval/signal/slip_interval.toml")
    parser.add_argument("--records", metavar="N", type="count", default=weak.RECORDS, help="per cell (default: 240)")


def _run(options: Namespace, _: Progress) -> StudyResult:
    if options.table:
        text = f"{slip.table()}\n{weak.table(options.jobs)}"
        return StudyResult(content={"table": text}, text=text)
    rows = weak.check(options.records)
    content = {"records": options.records, "rows": rows}
    return StudyResult(name="line_intervals", content=content, text=text_rows(rows))


STUDY = Study(question="Do the intervals of weak lines cover the truth?", minutes=4, run=_run, options=_options)
