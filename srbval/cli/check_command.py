"""``srbval check``: a fresh run against the reference results."""

import argparse
import math
from pathlib import Path

from srbval.check.check import (
    CheckResult,
    ReferenceQuantity,
    differences,
    read_reference,
    reference_path,
    renewed,
    run_check,
    write_reference,
)
from srbval.cli.output import answer, print_table
from srbval.progress import prefixed, progress_display
from srbval.storage.json_files import to_json


def run(options: argparse.Namespace) -> int:
    """Check, and with ``--update`` replace the reference; exit code 1 where anything is out of tolerance."""
    path = Path(options.reference) if options.reference else reference_path()
    reference = read_reference(path)
    with progress_display() as progress:
        result = run_check(reference, progress=prefixed(progress, "Check"))
    if options.update:
        return _update(options, path, reference, result)
    status, code = ("ok", 0) if result.ok else ("drifted", 1)
    return answer(options, result, lambda: _show(result), status=status, code=code)


def _show(result: CheckResult) -> None:
    rows = [(c.name, c.value, c.low, c.high, c.unit, "yes" if c.ok else "NO") for c in result.checks]
    print_table(("quantity", "value", "low", "high", "unit", "ok"), rows)
    for name in result.skipped:
        print(f"skipped, needs a recording that is not registered: {name}")
    for one in result.stale:
        print(f"note: reports/{one['file']} is stale: {one['why']}")
    for check in result.checks:
        if math.isnan(check.value + check.low):
            why = "could not be computed" if math.isnan(check.value) else "has no reference"
            print(f"{check.name}: {why}; {check.reason}")
        elif not check.ok:
            limits = f"{check.low:.9g} to {check.high:.9g} {check.unit}"
            print(f"{check.name}: {check.value:.9g} is not within {limits}; its tolerance: {check.reason}")


def _update(
    options: argparse.Namespace, path: Path, reference: dict[str, ReferenceQuantity], result: CheckResult
) -> int:
    new = renewed(reference, result)
    changed = differences(reference, new)
    if not options.json and changed:
        rows = [(c["name"], c["old"], c["new"], c["unit"], c["moved"] and round(c["moved"], 2)) for c in changed]
        print_table(("quantity", "reference", "now", "unit", "moved by tolerances"), rows)
    replaced = bool(changed) and options.yes
    if replaced:
        write_reference(path, new)
    document = to_json(result) | {"reference": path, "replaced": replaced, "differences": changed}
    left = f"{path}: replaced" if replaced else f"{path}: left as it was; give --yes to replace it"
    return answer(
        options, document, left if changed else f"{path}: nothing differs", code=0 if replaced or result.ok else 1
    )
