"""How far the work is: one callback signature for the whole package, and its display on standard error.

Whatever takes long has an option ``progress: Progress = silent`` and calls it with the name of the task and the
fraction of it that is done. `ProgressDisplay` is such a callback and shows what it is told: bars on a terminal, plain
lines elsewhere. All of them are safe to call from several threads.
"""

from srbval.progress.callback import Progress, prefixed, silent, stage
from srbval.progress.display import ProgressDisplay

__all__ = ["Progress", "ProgressDisplay", "prefixed", "silent", "stage"]
