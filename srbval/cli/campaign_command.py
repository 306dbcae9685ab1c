"""``srbval campaign``: run many cases, show their progress, export a labelled data set, and studies of both."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbval.campaign.campaign_folder import Damaged
from srbval.campaign.engines.choose import choose_engine
from srbval.campaign.export import ExportSettings, export_campaign
from srbval.campaign.planning import plan_cases, totals
from srbval.campaign.run import run_campaign
from srbval.campaign.settings import Campaign, load_campaign
from srbval.campaign.status import campaign_status
from srbval.campaign.verify import verify_campaign
from srbval.cli.output import print_json, print_table
from srbval.errors import DataError
from srbval.progress import ProgressDisplay
from srbval.recordings.raw import printable
from srbval.storage.json_files import to_json

DONE, WITH_FAILURES, DAMAGED = 0, 1, DataError.exit_code
SHOWN_FAILURES, LONGEST_REASON = 10, 1200


def run(options: argparse.Namespace) -> int:
    """Carry out the action; exit code 1 where cases failed, each of which has its reason."""
    return ACTIONS[options.action](options)


def _run(options: argparse.Namespace) -> int:
    given = {"limit_factor": options.limit_factor, "least_limit_s": options.least_limit}
    campaign = replace(
        load_campaign(options.campaign), **{name: value for name, value in given.items() if value is not None}
    )
    engine = choose_engine(
        options.engine, jobs=options.jobs, address=options.address, wait_s=options.wait, dashboard=options.dashboard
    )
    if options.dry_run:
        return _dry_run(campaign, engine.name, options)
    folder = Path(options.output or f"srbval-{campaign.name}")
    with ProgressDisplay() as progress:
        done = run_campaign(campaign, folder, engine=engine, progress=progress, message=progress.message)
    if options.json:
        print_json(to_json(done) | {"folder": folder})
    else:
        print(f"{done.done} of {done.cases} cases have a result, {done.ran} of them new, in {done.wall_s:.1f} s "
              f"({done.engine}); {len(done.failed)} failed. Results: {done.table}")  # fmt: skip
        _show_failures(done.failed)
    return WITH_FAILURES if done.failed else DONE


def _dry_run(campaign: Campaign, engine: str, options: argparse.Namespace) -> int:
    cases = plan_cases(campaign)
    found = totals(cases)
    if options.json:
        print_json({"name": campaign.name, "engine": engine, **to_json(found), "planned": cases})
        return DONE
    rows = [(c.index, c.model or "refused", c.expected_s, c.refused or _point(c.point)) for c in cases]
    print_table(("case", "model", "expected [s]", "values"), rows)
    models = ", ".join(f"{name} {count}" for name, count in found.models.items())
    time = "unknown" if found.expected_s is None else f"{found.expected_s:.0f} s on one core of the calibration machine"
    print(f"\n{found.cases} cases ({models}; {found.refused} refused); time: {time}; disk: "
          f"{found.expected_bytes / 1e6:.1f} MB. Nothing was run.")  # fmt: skip
    return DONE


def _point(point: Mapping[str, Any]) -> str:
    return ", ".join(f"{key} = {value}" for key, value in point.items())


def _status(options: argparse.Namespace) -> int:
    found = campaign_status(Path(options.folder))
    if options.json:
        print_json(to_json(found))
        return DAMAGED if found.damaged else DONE
    running = f"running{found.running}" if found.running else "not running"
    print(f"{found.name}: {found.done} of {found.cases} cases have a result, {len(found.failed)} failed; {running}. "
          f"Results: {found.table or 'cannot be written here'}")  # fmt: skip
    _show_failures(found.failed)
    return _show_damaged(found.damaged)


def _verify(options: argparse.Namespace) -> int:
    found = verify_campaign(Path(options.folder))
    if options.json:
        print_json(to_json(found), status="ok" if found.ok else "damaged")
        return DONE if found.ok else DAMAGED
    print(f"{found.results} results, plan, journal and table read, {len(found.damaged)} damaged")
    return _show_damaged(found.damaged)


def _show_damaged(damaged: Sequence[Damaged]) -> int:
    for found in damaged:
        print(f"{found.file}: {found.why}")
    if damaged:
        print("The same srbval campaign run repairs it: damaged results are run again, other files are rewritten.")
    return DAMAGED if damaged else DONE


def _show_failures(failed: Sequence[Mapping[str, Any]]) -> None:
    """Failures by reason, the most frequent first."""
    reasons: dict[str, list[int]] = {}
    for entry in failed:
        reasons.setdefault(f"{entry['ending']}: {printable(entry['reason'], LONGEST_REASON)}", []).append(entry["case"])
    for reason, cases in sorted(reasons.items(), key=lambda item: -len(item[1]))[:SHOWN_FAILURES]:
        which = ", ".join(map(str, cases[:SHOWN_FAILURES])) + (", ..." if len(cases) > SHOWN_FAILURES else "")
        print(f"{len(cases)} x {reason} (case {which})")


def _export(options: argparse.Namespace) -> int:
    settings = ExportSettings(
        segment_s=options.segment_seconds, snr_db=tuple(options.snr_db), noise=options.noise, seed=options.seed
    )
    made = export_campaign(Path(options.folder), Path(options.output), settings)
    if options.json:
        print_json(to_json(made))
    else:
        print(f"{made.segments} segments of {made.samples} samples in {made.file}; {made.left_out} cases left out")
    return DONE


ACTIONS = {"run": _run, "status": _status, "verify": _verify, "export": _export}
