"""Progress speaks where it should and stays silent where it should."""

import io
import re
import threading
import time

from srbval.report.progress import Progress
from srbval.report.progress import lines as lines_module

LONGEST_S = 30.0  # on a busy machine a thread waits long for its turn


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_lines_say_start_and_end():
    stream = io.StringIO()
    with Progress(stream=stream) as progress:
        task = progress.add("Simulate [OR]", total=10.0)
        progress.update(task, 5.0)
        progress.message("half [way]")
        progress.finish(task)
        progress.finish(task)
    said = stream.getvalue().splitlines()
    assert said[:2] == ["Simulate [OR] ...", "half [way]"]
    assert len(said) == 3
    assert said[2].startswith("Simulate [OR]: done in ")


def test_a_silent_worker_is_spoken_for(monkeypatch):
    monkeypatch.setattr(lines_module, "LINE_EVERY_S", 0.06)
    stream = io.StringIO()
    with Progress(stream=stream) as progress:
        task = progress.add("Simulate", total=4.0)
        progress.update(task, 1.0)
        _wait_for(r"Simulate: 25 % after \d+ s", 1, stream)


def test_a_stage_is_spoken_of_while_nothing_else_is(monkeypatch):
    monkeypatch.setattr(lines_module, "LINE_EVERY_S", 0.06)
    stream = io.StringIO()
    with Progress(stream=stream) as progress:
        progress.stage("Compile")
        _wait_for(r"Compile: after \d+ s", 2, stream)
        progress.stage("Draw")
        _wait_for(r"Draw: after \d+ s", 2, stream)
    said = stream.getvalue().splitlines()
    assert said[0] == "Compile ..."
    assert not any(line.startswith("Compile") for line in said[said.index("Draw ...") :])


def test_bars_are_drawn_on_a_terminal(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    stream = Terminal()
    with Progress(stream=stream) as progress:
        progress.stage("Analyse [it]")
        progress.finish(progress.add("Simulate [OR]", total=None))
    assert "Simulate [OR]" in stream.getvalue()
    assert "Analyse [it]" in stream.getvalue()
    assert "100%" in stream.getvalue()


def test_silence_is_silence(capsys):
    with Progress(silent=True) as progress:
        progress.update(progress.add("x"), 1.0)
        progress.message("y")
    assert capsys.readouterr() == ("", "")


def test_many_threads_lose_no_line():
    stream = io.StringIO()
    with Progress(stream=stream) as progress:
        threads = [threading.Thread(target=lambda i=i: progress.finish(progress.add(f"t{i}"))) for i in range(20)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    said = stream.getvalue().splitlines()
    assert sum(line.endswith(" ...") for line in said) == 20
    assert sum(": done in " in line for line in said) == 20


def _wait_for(line: str, times: int, stream: io.StringIO) -> None:
    """Wait until `stream` holds what matches `line` so many times; it never does: fail."""
    end = time.monotonic() + LONGEST_S
    while len(re.findall(line, stream.getvalue())) < times:
        assert time.monotonic() < end, stream.getvalue()
        time.sleep(0.01)
