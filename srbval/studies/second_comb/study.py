"""Which combs near BPFO the rig's records carry, band by band.

Of every record of the rig at one nominal speed (default: 877 rpm), those that come with the program where none is
registered: the order of the strongest comb within 1 % of BPFO, by the tachometer's speed, and its power over noise.
A comb of the shaft, of a transmission or of the drive would have one order in all records; a cage's wanders.
"""

from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from typing import Any

from srbval.bearing import load_bearing
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.recordings.registry import load_entry, rig_recordings
from srbval.studies.harness import Study, StudyResult

# The paper's bands and what lies above, cut at the drive's tones near 4 and 8 kHz.
BANDS_HZ = ((500.0, 1400.0), (1400.0, 2800.0), (3000.0, 4000.0), (4500.0, 6500.0), (6500.0, 7900.0), (8900.0, 9900.0))


def rows(nominal_rpm: float) -> Iterator[dict[str, Any]]:
    """One of each record and band."""
    bearing = load_bearing("skf-22240")
    for entry in rig_recordings(nominal_rpm=nominal_rpm):
        recording = load_entry(entry)
        for band in BANDS_HZ:
            analysis = analyse(recording, bearing=bearing, band_hz=band)
            line, turn_hz = analysis.line("BPFO"), analysis.speed.value_hz
            if line.found_hz is not None and line.ci95_hz is not None:
                yield {
                    "record": recording.state, "low_hz": band[0], "high_hz": band[1], "order": line.found_hz / turn_hz,
                    "ci95": line.ci95_hz / turn_hz, "snr": line.snr, "detected": line.detected,
                }  # fmt: skip


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--rpm", type="positive", default=877.0, help="nominal motor speed (default: 877)")


def _run(options: Namespace, _: Progress) -> StudyResult:
    found = list(rows(options.rpm))
    return StudyResult(name="second_comb", content={"nominal_rpm": options.rpm, "rows": found}, text=text_rows(found))


STUDY = Study(
    question="Which combs near BPFO do the rig's records carry, band by band?", minutes=1, run=_run, options=_options
)
