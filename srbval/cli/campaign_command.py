"""``srbval campaign``: run many cases, see how far they are, make a labelled data set of them."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbval.cli.campaign_progress import CampaignProgress
from srbval.cli.output import print_json, print_table

DONE, WITH_FAILURES = 0, 1
SHOWN_FAILURES = 10


def run(options: argparse.Namespace) -> int:
    """Do what the action says; exit code 1 where cases failed, each of which has its reason."""
    actions = {"run": _run, "status": _status, "export": _export, "noise": _noise, "scale": _scale}
    return actions[options.action](options)


def _run(options: argparse.Namespace) -> int:
    from srbval.campaign.engines.choose import choose_engine
    from srbval.campaign.run import run_campaign
    from srbval.campaign.settings import load_campaign

    given = {"limit_factor": options.limit_factor, "least_limit_s": options.least_limit}
    campaign = replace(
        load_campaign(options.campaign), **{name: value for name, value in given.items() if value is not None}
    )
    engine = choose_engine(options.engine, jobs=options.jobs, address=options.address, wait_s=options.wait)
    if options.dry_run:
        return _dry_run(campaign, engine.name, options)
    folder = Path(options.output or f"srbval-{campaign.name}")
    with CampaignProgress() as shown:
        done = run_campaign(campaign, folder, engine=engine, progress=shown.update, say=shown.say)
    if options.json:
        print_json(done.to_dict() | {"folder": folder})
    else:
        print(f"{done.done} of {done.cases} cases have a result, {done.ran} of them new, in {done.wall_s:.1f} s "
              f"({done.engine}); {len(done.failed)} failed. Results: {done.table}")  # fmt: skip
        _show_failures(done.failed)
    return WITH_FAILURES if done.failed else DONE


def _dry_run(campaign: Any, engine: str, options: argparse.Namespace) -> int:
    from srbval.campaign.planning import plan_cases, totals

    cases = plan_cases(campaign)
    found = totals(cases)
    if options.json:
        planned = [case.to_dict() for case in cases]
        print_json({"name": campaign.name, "engine": engine, **vars(found), "planned": planned})
        return DONE
    rows = [(c.index, c.model or "refused", c.expected_s, c.refused or _point(c.point)) for c in cases]
    print_table(("case", "model", "expected [s]", "what it is"), rows)
    models = ", ".join(f"{name} {count}" for name, count in found.models.items())
    time = "unknown" if found.expected_s is None else f"{found.expected_s:.0f} s on one core of the calibration machine"
    print(f"\n{found.cases} cases ({models}; {found.refused} refused); time: {time}; disk: "
          f"{found.expected_bytes / 1e6:.1f} MB. Nothing was run.")  # fmt: skip
    return DONE


def _point(point: Any) -> str:
    return ", ".join(f"{key} = {value}" for key, value in point.items())


def _status(options: argparse.Namespace) -> int:
    from srbval.campaign.status import campaign_status

    found = campaign_status(Path(options.folder))
    if options.json:
        print_json(found.to_dict())
        return DONE
    running = f"running{found.running}" if found.running else "not running"
    print(f"{found.name}: {found.done} of {found.cases} cases have a result, {len(found.failed)} failed; {running}. "
          f"Results: {found.table or 'cannot be written here'}")  # fmt: skip
    _show_failures(found.failed)
    return DONE


def _show_failures(failed: Any) -> None:
    """Failures by reason, the most frequent first."""
    reasons: dict[str, list[int]] = {}
    for entry in failed:
        reasons.setdefault(f"{entry['ending']}: {entry['reason']}", []).append(entry["case"])
    for reason, cases in sorted(reasons.items(), key=lambda item: -len(item[1]))[:SHOWN_FAILURES]:
        which = ", ".join(map(str, cases[:SHOWN_FAILURES])) + (", ..." if len(cases) > SHOWN_FAILURES else "")
        print(f"{len(cases)} x {reason} (case {which})")


def _export(options: argparse.Namespace) -> int:
    from srbval.campaign.export import export_campaign
    from srbval.campaign.export_settings import ExportSettings

    settings = ExportSettings(
        segment_s=options.segment_seconds, snr_db=tuple(options.snr_db), noise=options.noise, seed=options.seed
    )
    made = export_campaign(Path(options.folder), Path(options.output), settings)
    if options.json:
        print_json(made.to_dict())
    else:
        print(f"{made.segments} segments of {made.samples} samples in {made.file}; {made.left_out} cases left out")
    return DONE


def _noise(options: argparse.Namespace) -> int:
    from srbval.campaign.noise_study import noise_study
    from srbval.cli.tasks import Tasks
    from srbval.report.progress import Progress
    from srbval.storage.stored_result import NOISE_STUDY

    with Progress() as progress:
        rows = noise_study(noises=options.noise, seconds=options.seconds, progress=Tasks(progress, "campaign"))
    table = [row.to_dict() for row in rows]
    if not options.json:
        print_table(list(table[0]), [list(row.values()) for row in table])
    colours = " ".join(Path(noise).name for noise in options.noise)
    return _keep(NOISE_STUDY, {"rows": table, "seconds": options.seconds}, f"--noise {colours}", options)


def _scale(options: argparse.Namespace) -> int:
    from srbval.campaign.engines.choose import choose_engine
    from srbval.campaign.scale import measure_scale, reckoned
    from srbval.storage.stored_result import CAMPAIGN_SCALE

    found = measure_scale(options.cases, choose_engine(options.engine))
    rows = reckoned(found)
    if not options.json:
        print_table(("measured", "value"), list(vars(found).items()))
        print_table(list(rows[0]), [list(row.values()) for row in rows])
    return _keep(CAMPAIGN_SCALE, {"measured": vars(found), "reckoned": rows}, f"--cases {options.cases}", options)


def _keep(kind: str, result: dict[str, Any], more: str, options: argparse.Namespace) -> int:
    from srbval.cli.measured import this_machine
    from srbval.storage.revision import git_revision
    from srbval.storage.stored_result import COMMAND, stamped, store_result

    content = stamped(
        kind, {"machine": this_machine(), **result}, command=f"{COMMAND[kind]} {more}", revision=git_revision()
    )
    path = store_result(content, Path(options.output) if options.output else None)
    if options.json:
        print_json({**content, "file": path})
    else:
        print(f"kept in {path}")
    return DONE
