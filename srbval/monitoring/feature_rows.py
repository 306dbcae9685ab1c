"""Table of features: a row for each channel of each record."""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from srbval.diagnosis.records import RecordRequest, build_request
from srbval.monitoring.batch import FailedFile, answers_of, requests_for, separate_other_files
from srbval.progress import Progress, silent
from srbval.recordings.registry import RecordSource
from srbval.recordings.speed import RPM_PER_HZ
from srbval.recordings.units import ACCELERATION_UNIT, UNKNOWN

if TYPE_CHECKING:
    import pandas

LEVEL_FEATURES = ("rms", "peak", "band_rms")  # of a row of features, in the unit of the record


def record_features(
    sources: RecordSource | Iterable[RecordSource],
    request: RecordRequest | None = None,
    *,
    jobs: int | None = None,
    progress: Progress = silent,
    **stated: Any,
) -> "pandas.DataFrame":
    """Compute a table of features with a row for each channel of each record; columns as in `feature_row`.

    `sources` are files, folders, recordings or runs. `stated` are fields of `RecordRequest` or `RecordingSettings`,
    such as `bearing`, `rpm`, `channel` or `band_hz`; a `request` replaces them. All records use the stated band, the
    band of their data set, or the whole band; with `auto_band` each record has its own band. A record that cannot be
    read has a row with the `reason` alone; if no record can be read, an error is raised.
    """
    import pandas

    given = [sources] if isinstance(sources, RecordSource) else list(sources)
    asked = request or build_request(stated)
    requests = requests_for(given, replace(asked, one_band=not asked.auto_band))
    answers = answers_of(requests, jobs=jobs, progress=progress)
    failed = [answer for answer in answers.values() if isinstance(answer, FailedFile)]
    read = [document for answer in answers.values() if isinstance(answer, list) for document in answer]
    shown, _ = separate_other_files(failed, [str(source) for source in given], read)
    rows: list[Mapping[str, Any]] = []
    for answer in (answers[one] for one in requests):
        if isinstance(answer, list):
            rows += map(feature_row, answer)
        elif answer in shown:
            rows.append({"file": answer.file, "reason": str(answer.error).removeprefix(f"{answer.file}: ")})
    rows = json.loads(json.dumps(rows, ensure_ascii=False).encode("utf-8", "replace"))  # names that no text can have
    return pandas.DataFrame(rows, columns=list(dict.fromkeys(k for row in sorted(rows, key=len)[::-1] for k in row)))


def feature_row(document: Mapping[str, Any]) -> dict[str, Any]:
    """Convert an analysis document to a row of the feature table; the column `reason` explains missing values."""
    found, (low_hz, high_hz) = document["features"], document["band_hz"]
    unit, missing = found["unit"], [found["velocity_missing"]]
    if unit != ACCELERATION_UNIT:
        missing.append(f"no levels in {ACCELERATION_UNIT}: the unit is {unit}")
    row = {key: document[key] for key in ("file", "name", "channel", "bearing", "fs_hz", "seconds")}
    row |= {"state": document["declared_state"], "speed_rpm": RPM_PER_HZ * document["shaft_hz"]["value"]}
    row |= {"band_low_hz": low_hz, "band_high_hz": high_hz}
    for kind in (ACCELERATION_UNIT, unit):
        word = re.sub(r"\W", "_", kind) if kind != UNKNOWN else "unknown_unit"
        row |= {f"{name}_{word}": found[name] if kind == unit else None for name in LEVEL_FEATURES}
    row |= {"crest_factor": found["crest"]} | {key: found[key] for key in ("kurtosis", "velocity_rms_mm_s")}
    for line in document["lines"]:
        name = line["name"].lower().replace("-", "_minus_").replace("+", "_plus_")  # of sidebands, as BPFI-fr
        row |= {f"{name}_harmonic_{line['harmonic']}_{key}": line[key] for key in ("snr", "depth")}
        if line["snr"] is None:
            missing.append(f"{line['harmonic']} x {line['name']}: {line['not_detected']}")
    if document.get("snapshot"):
        missing.append("too short to search for lines: first harmonics at their calculated place")
    return row | {"reason": "; ".join(filter(None, missing))}
