"""Progress is shown where it should be and is silent where it should be."""

import io
import re

import pytest

import srbval.progress
from srbval.progress import LATER, ProgressDisplay, stage
from tests.marked import until

FAST_S = 0.06  # instead of seconds between two lines, so that the tests are short


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_lines_report_the_beginning_and_the_end():
    stream = io.StringIO()
    with ProgressDisplay(stream) as progress:
        progress("Simulate [OR]", 0.0)
        progress("Simulate [OR]", 0.5)
        progress.message("half [way]")
        progress("Simulate [OR]", 1.0)
    written = stream.getvalue().splitlines()
    assert written[:2] == ["Simulate [OR] ...", "half [way]"]
    assert len(written) == 3
    assert written[2].startswith("Simulate [OR]: done in ")


@pytest.mark.parametrize("fraction", [None, 0.5])
def test_lines_in_a_log_become_rarer(fraction, monkeypatch):
    monkeypatch.setattr(srbval.progress, "LINE_AFTER_S", FAST_S / 10)
    stream = io.StringIO()
    with ProgressDisplay(stream) as progress:
        progress("Draw", fraction)
        until(lambda: stream.getvalue().count("after") >= 4)
        progress("Draw", 1.0)
    written = stream.getvalue().splitlines()
    assert (written[0], written[-1][:12]) == ("Draw ...", "Draw: done i")
    assert ("50 %" in written[1], "to go" in written[1]) == (fraction is not None,) * 2
    assert float(written[-1].split()[3]) >= LATER**3 * FAST_S / 10


def test_a_task_of_unknown_extent_is_reported_while_nothing_else_is(monkeypatch):
    monkeypatch.setattr(srbval.progress, "LINE_AFTER_S", FAST_S)
    stream = io.StringIO()
    with ProgressDisplay(stream) as progress:
        with stage(progress, "Compile"):
            until(lambda: len(re.findall(r"Compile: after \d+ s", stream.getvalue())) >= 2)
        with stage(progress, "Draw"):
            until(lambda: len(re.findall(r"Draw: after \d+ s", stream.getvalue())) >= 2)
    written = stream.getvalue().splitlines()
    assert written[0] == "Compile ..."
    assert not any(line.startswith("Compile") for line in written[written.index("Draw ...") :])


def test_one_line_of_a_terminal_is_written_over(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    stream = Terminal()
    with ProgressDisplay(stream) as progress:
        progress("Simulate [OR] with a name that is longer than the line", 0.0)
        progress.message("a [line]")
        progress("Simulate [OR] with a name that is longer than the line", 1.0)
        progress("Draw", None)
    first, *rest = stream.getvalue().split("\r")[1:]
    assert first == "Simulate [OR] with a name that is longer"[:39]
    assert rest[0] == "a [line]".ljust(39) + "\n"
    assert rest[1].startswith("Simulate [OR] with a name that is longer than the line: done in ")
    assert (rest[2], rest[-1]) == ("Draw ...", "        \n")  # a task that did not end leaves no line behind


def test_a_failed_stage_is_not_reported_as_done():
    calls: list[tuple[str, float | None]] = []
    with pytest.raises(KeyError), stage(lambda *call: calls.append(call), "Draw"):
        raise KeyError
    assert calls == [("Draw", None)]
