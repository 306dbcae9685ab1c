"""The model's runs at the speeds of the rig's records that come with the program, beyond the first of each.

`srbval report` takes what it compares from here instead of simulating 42 runs. `starts`: by `start_key`, for every
compared quantity its `value`, the `least` that would be shown, and whether it is `present`.
"""

from argparse import Namespace

from srbval.bearing import DEFAULT_BEARING, DEFECTS, load_bearing
from srbval.comparison.counterpart import COUNTERPARTS, counterpart_cases, start_key, start_values
from srbval.progress import Progress
from srbval.reading.analyse import analyse
from srbval.recordings.registry import load_entry
from srbval.recordings.registry.register import shipped_recordings
from srbval.studies.harness import StudyResult, input_hashes
from srbval.sweep.pool import side_by_side


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    records, bearing = [one for one in shipped_recordings() if one.state in DEFECTS], load_bearing(DEFAULT_BEARING)
    of_records = [counterpart_cases(analyse(load_entry(one), bearing=bearing)) for one in records]
    cases = {start_key(one, bearing): one for _, *others in of_records for one in others}
    starts = side_by_side(
        {key: case.scene for key, case in cases.items()},
        lambda key, report: start_values(cases[key], bearing, progress=report),
        task="Simulate the records' counterparts", jobs=options.jobs, progress=progress,
    )  # fmt: skip
    text = f"{len(starts)} further starts of the counterparts of {len(records)} records"
    return StudyResult(name=COUNTERPARTS, content={"starts": starts}, text=text, inputs=input_hashes(*records))
