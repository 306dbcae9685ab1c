"""``srbval check``: the program's behaviour against its reference, and the stored evidence that is stale."""

import argparse

import pandas as pd

from srbval.check.check import CheckResult, differences, reference_path, run_check, write_reference
from srbval.cli.output import answer, print_table
from srbval.progress import prefixed, progress_display
from srbval.storage.behaviour import reference_fingerprint
from srbval.storage.json_files import to_json

SHOWN = 20  # quantities out of tolerance that are printed; --json has all


def run(options: argparse.Namespace) -> int:
    """Check, and with ``--update`` replace the reference; exit code 1 if anything is out of tolerance or stale."""
    old = reference_fingerprint()
    with progress_display() as progress:
        result = run_check(progress=prefixed(progress, "Check"))
    document = {key: value for key, value in to_json(result).items() if key != "now"}
    if options.update:
        changed = differences(old, result.now)
        replaced = bool(changed) and options.yes
        if replaced:
            write_reference(result.now)
        left = "replaced" if replaced else "left as it was; give --yes to replace it"
        text = f"{reference_path()}: {left if changed else 'nothing differs'}; {len(changed)} quantities differ"
        document |= {"reference": reference_path(), "replaced": replaced, "differences": changed}
        return answer(options, document, text, code=0 if replaced or not changed else 1)
    drifted = not all(check.ok for check in result.checks)
    status = "drifted" if drifted else "stale" if result.stale else "ok"
    return answer(options, document, lambda: _show(result), status=status, code=0 if result.ok else 1)


def _show(result: CheckResult) -> None:
    checks = pd.DataFrame([vars(check) for check in result.checks])
    parts = checks["name"].str.partition(":")[0]
    counted = checks.groupby(parts, sort=False)["ok"].agg(["size", "sum"])
    rows = [(part, size, size - within) for part, size, within in counted.itertuples()]
    print_table(("part of the program", "quantities", "out of tolerance"), rows)
    wrong = [check for check in result.checks if not check.ok]
    for check in wrong[:SHOWN]:
        if check.words:
            print(f"{check.name}: {check.words[1]}, the reference is {check.words[0]}")
        else:
            print(f"{check.name}: {check.value:.9g} is not within {check.low:.9g} to {check.high:.9g}")
    if len(wrong) > SHOWN:
        print(f"and {len(wrong) - SHOWN} more; --json lists all")
    for one in result.stale:
        print(f"stale: reports/{one['file']}: {one['why']}. Compute it again: srbval evidence {one['file'][:-5]}")
    if result.ok:
        print("Every quantity is within its tolerance, and no stored evidence is stale.")
