"""What the measuring commands have in common: measure under a progress display, stamp, store and print."""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from srbval.cli.output import own_command, print_json
from srbval.processes.machine import processor_name, usable_cores
from srbval.progress import Progress, ProgressDisplay, prefixed
from srbval.storage.own_package import git_revision
from srbval.storage.stored_result import stamped, store_stamped
from srbval.storage.strict_json import json_value

Result = TypeVar("Result")


def measure_and_print(
    kind: str,
    options: argparse.Namespace,
    measure: Callable[[Progress], Result],
    *,
    complete: bool,
    show: Callable[[Result], object],
) -> Result:
    """Measure, store the result where asked or, if it is a `complete` one, for the report, and print it.

    `kind` is the kind of stored result. What `measure` returns is a mapping or a dataclass; `show` prints it where no
    JSON is wanted. The revision of the program is the one at the beginning: measuring may take hours.
    """
    revision = git_revision()
    with ProgressDisplay() as progress:
        result = measure(prefixed(progress, options.command.capitalize()))
    document: dict[str, Any] = {"machine": this_machine()} | json_value(result)
    content = stamped(kind, document, command=own_command(), revision=revision)
    if options.output or complete:
        path = store_stamped(content, Path(options.output) if options.output else None)
        print(f"stored: {path}", file=sys.stderr)
        content |= {"file": path}
    if options.json:
        print_json(content)
    else:
        show(result)
    return result


def this_machine() -> dict[str, Any]:
    """Processor and usable cores, as stored results name them."""
    return {"processor": processor_name(), "usable_cores": usable_cores()}
