"""What commands that measure have in common: the result is stamped, kept for the report, and printed."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from srbval.bench.machine import processor_name, usable_cores
from srbval.cli.output import own_command, print_json
from srbval.storage.stored_result import stamped, store_result


def keep_and_print(
    kind: str,
    result: Mapping[str, Any],
    options: argparse.Namespace,
    *,
    revision: str | None,
    whole: bool,
    show: Callable[[], object],
) -> None:
    """Keep `result` where asked, or, if it is a `whole` one, for the report; then its JSON, or `show` prints it.

    `revision` is the one that was read when measuring began.
    """
    content = stamped(kind, result, command=own_command(), revision=revision)
    if options.output or whole:
        path = store_result(content, Path(options.output) if options.output else None)
        print(f"kept: {path}", file=sys.stderr)
    if options.json:
        print_json(content)
    else:
        show()


def this_machine() -> dict[str, Any]:
    """Processor and usable cores, as kept results name them."""
    return {"processor": processor_name(), "usable_cores": usable_cores()}
