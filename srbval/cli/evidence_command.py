"""``srbval evidence``: list the stored results, and compute those again that no longer hold."""

import argparse
from collections.abc import Sequence

from srbval.check.fingerprint import fingerprint
from srbval.cli.output import answer, own_command, print_table
from srbval.progress import progress_display
from srbval.storage.json_files import to_json
from srbval.storage.stored_result import ResultKind
from srbval.studies.evidence import ResultState, recompute, result_states


def run(options: argparse.Namespace) -> int:
    """List or compute; exit code 1 if evidence is stale at the end, or a study's own test fails."""
    with progress_display() as progress:
        if options.list:
            states = [one for one in result_states(fingerprint(progress=progress)) if _is_asked(one, options.names)]
        else:
            states = list(
                recompute(
                    options.names,
                    every=options.all,
                    jobs=options.jobs,
                    progress=progress,
                    message=progress.message,
                    command=own_command(),
                )
            )
    stale = [one for one in states if one.kind is ResultKind.EVIDENCE and not one.fresh]
    code = 1 if stale or not all(one.sound for one in states) else 0
    status = "stale" if stale else "ok" if code == 0 else "unsound"
    return answer(options, {"results": to_json(states)}, lambda: _show(states), status=status, code=code)


def _is_asked(state: ResultState, names: Sequence[str]) -> bool:
    return not names or state.name in names


def _show(states: Sequence[ResultState]) -> None:
    rows = [
        (one.name, one.kind.value, _word(one), one.made_utc or "", one.minutes, one.machine or "", one.why or "")
        for one in states
    ]
    print_table(("result", "kind", "holds", "computed", "minutes", "machine", "why not"), rows)
    minutes = [one.minutes for one in states if one.minutes is not None and one.kind is ResultKind.EVIDENCE]
    if minutes:
        print(f"evidence took {sum(minutes):.1f} minutes in all")


def _word(state: ResultState) -> str:
    if state.kind is not ResultKind.EVIDENCE:
        return "as recorded" if state.kind is ResultKind.RECORDED else "of its revision"
    return "yes" if state.fresh else "no"
