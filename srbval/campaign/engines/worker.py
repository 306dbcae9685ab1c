"""The worker process of `local`: reads requests from standard input, answers on what was standard output.

``python -m srbval.campaign.engines.worker``; ends when its input ends, in the middle of a case if need be.
"""

import os
import pickle
import queue
import signal
import sys
import threading
from pathlib import Path
from typing import IO, Any


def main() -> None:
    """Answer until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the campaign's own process handles Ctrl-C
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints must not get between the answers
    requests: queue.Queue[tuple[str, Any]] = queue.Queue()
    threading.Thread(target=_read, args=(sys.stdin.buffer, requests), daemon=True).start()
    from srbval.campaign.work import load_modules, prepare, run_within_limit

    load_modules(Path())

    while True:
        kind, content = requests.get()
        pickle.dump(prepare(content) if kind == "prepare" else run_within_limit(content), answers)
        answers.flush()


def _read(stream: IO[bytes], requests: queue.Queue[tuple[str, Any]]) -> None:
    """Pass requests on; when the input ends, the asking process is gone: end at once."""
    try:
        while True:
            requests.put(pickle.load(stream))
    except (EOFError, OSError, pickle.UnpicklingError):
        os._exit(0)


if __name__ == "__main__":
    main()
