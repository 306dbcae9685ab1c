"""Commands ``srbval campaign run``, ``status`` and ``verify``."""

import argparse
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbval.campaign.cases import Campaign, campaign_of, plan_cases
from srbval.campaign.engines import LOCAL, choose_engine
from srbval.campaign.run import campaign_status, run_campaign, verify_campaign
from srbval.cli.output import print_result
from srbval.errors import ConfigurationError, DataError
from srbval.progress import ProgressDisplay
from srbval.progress.tables import text_table
from srbval.recordings.raw import printable
from srbval.scene import merge

SHOWN_FAILURES, LONGEST_REASON = 10, 1200


def run_campaign_command(options: argparse.Namespace) -> int:
    """Run the cases of a campaign and print the result; exit code 1 if some failed or are inaccurate."""
    campaign = campaign_of(options.campaign)
    scene = merge(campaign.scene, {"model": options.model}) if options.model else None
    given = {"limit_factor": options.limit_factor, "least_limit_s": options.least_limit, "scene": scene}
    campaign = replace(campaign, **{name: value for name, value in given.items() if value is not None})
    clusters = [name for name in (options.scheduler, options.cluster_class) if name]
    if len(clusters) + (options.engine == LOCAL) > 1:
        raise ConfigurationError(f"--scheduler, --cluster-class and --engine {LOCAL} exclude each other: keep one.")
    chosen, cluster_options = [*clusters, options.engine or LOCAL][0], dict(options.cluster_option or ())
    given = {"jobs": options.jobs, "wait_s": options.wait, "adapt": options.adapt}
    engine = choose_engine(chosen, cluster_options=cluster_options, **given)
    if options.dry_run:
        return _dry_run(campaign, engine.name, options)
    folder = Path(options.output or f"srbval-{campaign.name}")
    with ProgressDisplay() as progress:
        done = run_campaign(campaign, folder, engine=engine, progress=progress, message=progress.message)
    new = f"{done['ran']} of them new, in {done['wall_s']:.1f} s ({done['engine']})"
    text = "\n".join([f"{_count_statuses(done)}; {new}. Results: {done['table']}", *_reasons(done)])
    bad = "with failures" if done["failed"] else "with inaccurate cases" if done["inaccurate"] else ""
    return print_result(options, done | {"folder": folder}, text, status=bad, code=1 if bad else 0)


def _dry_run(campaign: Campaign, engine: str, options: argparse.Namespace) -> int:
    cases = plan_cases(campaign)
    good = [case for case in cases if case.refused is None]
    distinct = {case.key: case for case in good}.values()  # equal cases run only once
    times_s = [case.expected_s for case in distinct]
    found: dict[str, Any] = {
        "cases": len(cases),
        "models": dict(Counter(case.model for case in good)),
        "refused": len(cases) - len(good),
        "expected_s": None if None in times_s else sum(filter(None, times_s)),
        "expected_bytes": sum(case.expected_bytes for case in distinct),
    }

    def show() -> None:
        points = [c.refused or ", ".join(f"{key} = {value}" for key, value in c.point.items()) for c in cases]
        rows = [(c.index, c.model or "refused", c.expected_s, said) for c, said in zip(cases, points, strict=True)]
        print(text_table(("case", "model", "expected [s]", "values"), rows))
        models = ", ".join(f"{name} {count}" for name, count in found["models"].items())
        expected_s = found["expected_s"]
        time = "unknown" if expected_s is None else f"{expected_s:.0f} s on one core of the reference machine"
        size = f"time: {time}; disk: {found['expected_bytes'] / 1e6:.1f} MB"
        print(f"\n{found['cases']} cases ({models}; {found['refused']} refused); {size}. Nothing was run.")

    return print_result(options, {"name": campaign.name, "engine": engine, **found, "planned": cases}, show)


def run_status_command(options: argparse.Namespace) -> int:
    """Print the progress of a campaign and rewrite its results table."""
    found = campaign_status(Path(options.folder))
    running = "running" if found["running"] else "not running"
    table = found["table"] or "cannot be written here"
    text = f"{found['name']}: {_count_statuses(found)}; {running}. Results: {table}"
    return print_result(options, found, "\n".join([text, *_reasons(found)]))


def run_verify_command(options: argparse.Namespace) -> int:
    """Check all files of a campaign against their checksums; exit code 3 if some are damaged."""
    found = verify_campaign(Path(options.folder))
    lines = [f"{found['results']} results and the table of cases read, {len(found['damaged'])} damaged"]
    lines += [f"{one['file']}: {one['why']}" for one in found["damaged"]]
    if found["damaged"]:
        lines.append("To repair it, repeat srbval campaign run: cases with damaged results are run again.")
    code, status = (0, "ok") if found["ok"] else (DataError.exit_code, "damaged")
    return print_result(options, found, "\n".join(lines), code=code, status=status)


def _count_statuses(found: Mapping[str, Any]) -> str:
    """Text with the number of finished, failed and all cases, and the number per status."""
    statuses = ", ".join(f"{count} {status}" for status, count in found["statuses"].items()) or "none"
    return f"{found['done']} of {found['cases']} cases have a result: {statuses}; {len(found['failed'])} failed"


def _reasons(found: Mapping[str, Any]) -> Iterator[str]:
    """Yield a text line per reason of failure or inaccuracy, with its cases; the most frequent reason comes first."""
    reasons = defaultdict[str, list[int]](list)
    for entry in found["failed"] + found["inaccurate"]:
        reasons[f"{entry['status']}: {printable(entry['reason'], LONGEST_REASON)}"].append(entry["case"])
    for reason, cases in sorted(reasons.items(), key=lambda item: -len(item[1]))[:SHOWN_FAILURES]:
        which = ", ".join(map(str, cases[:SHOWN_FAILURES])) + (", ..." if len(cases) > SHOWN_FAILURES else "")
        yield f"{len(cases)} x {reason} (case {which})"
