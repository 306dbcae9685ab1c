"""``python -m tests.net``: record what a checkout does, compare another one with it, compare their speed."""

import argparse
import json
import shutil
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tests.net import commands, recorded, reports, trajectories
from tests.net.child import Checkout, scratch_folder
from tests.net.difference import allowed_changes, differences, renamed, renamed_keys
from tests.net.speed import compare_speed

# By item: what records it (name of an entry -> what was seen), and by how much its numbers may differ, relative.
ITEMS = {
    "trajectories": (trajectories.record, 0.0),
    "analyse": (recorded.record, 1e-12),
    "cli": (commands.record_uses, 1e-12),
    "hostile": (commands.record_hostile, 1e-12),
    "check": (commands.record_check, 1e-9),
    "report": (reports.record, 1e-9),
}
SHOWN = 12  # differences of one entry
HELP = """\
Items: trajectories (24 runs, bit for bit), analyse (every recording, 1e-12), cli (help, exit codes and messages),
hostile (damaged files), check (srbval check), report (report.json to 1e-9).
Planted errors are a test: pytest tests/verification/test_planted_errors.py.
SRBVAL_RECORDINGS names the folder of the recordings. Exit code 1: something differs that allowed_changes.toml does not
list. The record is good for one machine and one set of libraries: record and compare on the same."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one of the three commands; 0 where nothing differs."""
    options = _parser().parse_args(arguments)
    if options.command == "speed":
        compare_speed(options.old, options.new, pairs=options.pairs)
        return 0
    if options.command == "record":
        options.output.mkdir(parents=True, exist_ok=True)
        for item in options.only:
            _write(options.output / f"{item}.json", _recorded(item, options.checkout))
        return 0
    found = [_compared(item, options) for item in options.only]
    return 1 if any(found) else 0


def _compared(item: str, options: argparse.Namespace) -> int:
    """Print what differs in an item; the number of differences that are not allowed."""
    old = renamed(json.loads((options.folder / f"{item}.json").read_text(encoding="utf-8")), renamed_keys())
    if options.now:
        new = json.loads((options.now / f"{item}.json").read_text(encoding="utf-8"))
    else:
        new = _recorded(item, options.checkout)
    allowed, reasons, bad = allowed_changes(), Counter[str](), Counter[str]()
    for entry in {**old, **new}:
        sides = ({entry: side[entry]} if entry in side else {} for side in (old, new))
        for line in differences(*sides, ITEMS[item][1], item):
            reason = next((why for pattern, why in allowed if pattern.search(line)), None)
            if reason is not None:
                reasons[reason] += 1
                continue
            bad[entry] += 1
            if bad[entry] <= SHOWN:
                print(line)
        if bad[entry] > SHOWN:
            print(f"{item}/{entry}: {bad[entry] - SHOWN} more differences")
    bad = +bad  # without the entries in which nothing differs
    for reason, count in reasons.items():
        print(f"{item}: {count} allowed: {reason}")
    print(f"{item}: {len(old)} entries, {len(bad)} differ in {bad.total()} places", flush=True)
    return bad.total()


def _recorded(item: str, folder: Path) -> dict[str, Any]:
    """What the checkout in `folder` does now."""
    started = time.perf_counter()
    with scratch_folder() as scratch:
        checkout = Checkout(folder.resolve(), Path(scratch).resolve())
        checkout.check_import()
        found = ITEMS[item][0](checkout)
    print(f"{item}: {len(found)} entries of {folder} in {time.perf_counter() - started:.0f} s", file=sys.stderr)
    return found


def _write(path: Path, content: dict[str, Any]) -> None:
    part = path.with_suffix(".part")
    part.write_text(json.dumps(content, indent=1, ensure_ascii=False), encoding="utf-8")
    shutil.move(part, path)


def _parser() -> argparse.ArgumentParser:
    form = argparse.RawDescriptionHelpFormatter
    top = argparse.ArgumentParser(prog="python -m tests.net", description=__doc__, epilog=HELP, formatter_class=form)
    commands_ = top.add_subparsers(dest="command", required=True)
    record = commands_.add_parser("record", help="record what a checkout does")
    record.add_argument("-o", "--output", type=Path, required=True, help="folder to write, one JSON file for each item")
    compare = commands_.add_parser("compare", help="compare a checkout with a record")
    compare.add_argument("folder", type=Path, help="folder that `record` wrote")
    compare.add_argument("--now", type=Path, metavar="FOLDER", help="compare with this record; run nothing")
    for command in (record, compare):
        command.add_argument("--checkout", type=Path, default=Path(), help="default: the working directory")
        command.add_argument(
            "--only", nargs="+", choices=ITEMS, default=list(ITEMS), metavar="ITEM", help="these items"
        )
    speed = commands_.add_parser("speed", help="kernel times of two checkouts, in pairs")
    speed.add_argument("old", type=Path)
    speed.add_argument("new", type=Path)
    speed.add_argument("--pairs", type=int, default=7, help="pairs of runs of each model (default: 7)")
    return top


if __name__ == "__main__":
    sys.exit(main())
