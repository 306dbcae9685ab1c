"""Progress of a campaign on standard error: one line that changes on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import threading
import time
from types import TracebackType
from typing import Self, TextIO

from srbval.campaign.run import Progress

LINE_EVERY_S = 5.0
TERMINAL_EVERY_S = 0.5


class CampaignProgress:
    """``with CampaignProgress() as shown: run_campaign(..., progress=shown.update, say=shown.say)``."""

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream or sys.stderr
        self._terminal = self._stream.isatty()
        self._latest: Progress | None = None
        self._told: Progress | None = None
        self._at = self._started = time.monotonic()
        self._lock = threading.Lock()
        self._stopped = threading.Event()
        self._beat = threading.Thread(target=self._keep_talking, name="srbval-campaign-progress", daemon=True)

    def __enter__(self) -> Self:
        self._beat.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stopped.set()
        self._beat.join()
        with self._lock:
            if self._latest is not self._told:
                self._show()
            if self._terminal:
                print(file=self._stream, flush=True)

    def update(self, progress: Progress) -> None:
        """Note how far the campaign is."""
        with self._lock:
            first = self._latest is None
            self._latest, self._at = progress, time.monotonic()
            if first:
                self._show()

    def say(self, text: str) -> None:
        """Show one line of text."""
        with self._lock:
            print(f"{chr(13) if self._terminal else ''}{text}", file=self._stream, flush=True)

    def _keep_talking(self) -> None:
        while not self._stopped.wait(TERMINAL_EVERY_S if self._terminal else LINE_EVERY_S):
            with self._lock:
                self._show()

    def _show(self) -> None:
        if self._latest is None:
            return
        self._told = now = self._latest
        elapsed = time.monotonic() - self._started
        rest = ""
        if now.remaining_s is not None and now.done < now.cases:
            left = max(0.0, now.remaining_s - (time.monotonic() - self._at))
            rest = f", about {_span(left)} to go"
        text = f"campaign: {now.done} of {now.cases} cases, {now.failed} failed, after {_span(elapsed)}{rest}"
        print(f"{chr(13)}{text:<90}" if self._terminal else text, end="" if self._terminal else "\n",
              file=self._stream, flush=True)  # fmt: skip


def _span(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"
