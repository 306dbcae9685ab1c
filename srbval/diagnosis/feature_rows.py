"""Table of features: a row per record, for statistics and learning; names state the quantity and its unit."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from srbval.diagnosis.records import FailedFile, RecordRequest, answers_of, request_of, without_other_files
from srbval.progress import Progress, silent
from srbval.recordings.registry import RecordSource, files_of, recording_of
from srbval.recordings.speed import RPM_PER_HZ
from srbval.recordings.units import ACCELERATION, UNKNOWN

if TYPE_CHECKING:
    import pandas

LEVELS = ("rms", "peak", "band_rms")  # in the unit of the record
IN_NAMES = {"-": "_minus_", "+": "_plus_"}  # of sidebands, as BPFI-fr


def record_features(
    sources: RecordSource | Iterable[RecordSource],
    request: RecordRequest | None = None,
    *,
    jobs: int | None = None,
    progress: Progress = silent,
    **stated: Any,
) -> "pandas.DataFrame":
    """Table of features: a row for each channel of each record, in the order of `sources`; columns as `feature_row`.

    `sources` are files, folders, recordings and runs. What they leave open is `stated`, as fields of `RecordRequest` or
    `RecordingSettings` such as `bearing`, `rpm`, `channel`, `band_hz`, or by a `request`. All records have the band
    that is stated, that of their data set, or the whole one; with `auto_band` each has its own. A record that cannot be
    read has a row with the `reason` alone. Raises the error of the records if all fail.
    """
    import pandas

    given = [sources] if isinstance(sources, RecordSource) else list(sources)
    asked = request or request_of(stated)
    asked = replace(asked, one_band=not asked.auto_band)
    requests = list[RecordRequest]()
    for source in given:
        if isinstance(source, str | Path):
            requests += [replace(asked, file=file) for file in files_of([source])]
        else:
            requests.append(replace(asked, recording=recording_of(source, **vars(asked.settings))))
    answers = answers_of(requests, jobs=jobs, progress=progress)
    failed = [answer for answer in answers.values() if isinstance(answer, FailedFile)]
    read = [document for answer in answers.values() if isinstance(answer, list) for document in answer]
    of_files = [document for document in read if document["file"]]
    shown, _ = without_other_files(failed, [str(source) for source in given], of_files)
    rows: list[Mapping[str, Any]] = []
    for answer in (answers[one] for one in requests):
        if isinstance(answer, list):
            rows += map(feature_row, answer)
        elif answer in shown:
            rows.append({"file": answer.file, "reason": str(answer.error).removeprefix(f"{answer.file}: ")})
    return pandas.DataFrame(rows, columns=list(dict.fromkeys(k for row in sorted(rows, key=len)[::-1] for k in row)))


def feature_row(document: Mapping[str, Any]) -> dict[str, Any]:
    """Row of the table for a document of `answers_of`; None for what could not be computed, for the `reason`.

    Of the harmonics of each line: the height over the noise beside it (`snr`, power) and the modulation `depth` of the
    squared envelope at that place, whether the line is detected or not.
    """
    found, (low_hz, high_hz) = document["features"], document["band_hz"]
    unit, missing = found["unit"], [found["velocity_missing"]]
    if unit != ACCELERATION:
        missing.append(f"no levels in {ACCELERATION}: the unit is {unit}")
    row = {key: document[key] for key in ("file", "name", "channel", "bearing", "fs_hz", "seconds")}
    row |= {"state": document["declared_state"], "speed_rpm": RPM_PER_HZ * document["shaft_hz"]["value"]}
    row |= {"band_low_hz": low_hz, "band_high_hz": high_hz}
    for kind in (ACCELERATION, unit):
        word = re.sub(r"\W", "_", kind) if kind != UNKNOWN else "unknown_unit"
        row |= {f"{name}_{word}": found[name] if kind == unit else None for name in LEVELS}
    row |= {"crest_factor": found["crest"]} | {key: found[key] for key in ("kurtosis", "velocity_rms_mm_s")}
    for line in document["lines"]:
        name = re.sub("[-+]", lambda sign: IN_NAMES[sign[0]], line["name"].lower())
        row |= {f"{name}_harmonic_{line['harmonic']}_{key}": line[key] for key in ("snr", "depth")}
        if line["snr"] is None:
            missing.append(f"{line['harmonic']} x {line['name']}: {line['not_detected']}")
    if document.get("snapshot"):
        missing.append("too short to search for lines: first harmonics at their calculated place")
    return row | {"reason": "; ".join(filter(None, missing))}
