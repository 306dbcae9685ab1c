"""Progress on standard error: bars on a terminal, plain lines elsewhere, nothing when silenced.

Standard output stays free for data. All kinds are safe to use from several threads.
"""

from srbval.report.progress.progress import Progress

__all__ = ["Progress"]
