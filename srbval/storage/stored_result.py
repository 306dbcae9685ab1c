"""Results of long commands, stored as JSON files for the report: in the repository, newer ones in the user's cache.

A file says on which machine it was made, when, from which revision and by which command.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from srbval.config.small_file import read_small_file
from srbval.errors import DataError
from srbval.storage.cache import cache_folder
from srbval.storage.own_package import shipped_folder
from srbval.storage.strict_json import parse_json, write_json

SPEED_ACCURACY, STABILITY = "speed_accuracy", "stability"
NOISE_STUDY, CAMPAIGN_SCALE = "noise_study", "campaign_scale"
READING, SENSITIVITY = "reading", "sensitivity"
HELD_OUT, RIG_INPUTS, RIG_BANDS = "held_out", "rig_inputs", "rig_bands"
AMPLITUDES, WATERFALL, PREDICTIONS = "amplitudes", "waterfall", "predictions"
RIG_SPEED_ACCURACY, RIG_STABILITY = "rig_speed_accuracy", "rig_stability"
OWN_VERDICTS, RECORD_VERDICTS, DIAGNOSIS = "own_verdicts", "record_verdicts", "diagnosis"
VERDICT_SCAN = "verdict_scan"
BALL_RECORDS = "ball_records"
COMMAND = {
    SPEED_ACCURACY: "srbval bench",
    STABILITY: "srbval stability",
    NOISE_STUDY: "python -m srbval.studies.noise.study",
    CAMPAIGN_SCALE: "python -m srbval.studies.campaign_scale.study",
    READING: "python -m srbval.studies.reading_accuracy.study",
    SENSITIVITY: "srbval bench --sensitivity",
    VERDICT_SCAN: "srbval bench --sensitivity --scan",
    RECORD_VERDICTS: "python -m srbval.studies.record_verdicts.study",
    DIAGNOSIS: "srbval bench --diagnosis",
    HELD_OUT: "python -m srbval.studies.held_out.study",
    RIG_INPUTS: "python -m srbval.studies.rig_inputs.study",
    BALL_RECORDS: "python -m srbval.studies.ball_records.study -o reports/ball_records.json",
    AMPLITUDES: "python -m srbval.studies.amplitudes.study",
    WATERFALL: "python -m srbval.studies.waterfall.study",
    PREDICTIONS: "python -m srbval.studies.predictions.study",
    RIG_BANDS: "python -m srbval.studies.rig_bands.study",
    RIG_SPEED_ACCURACY: "srbval bench --scenes rig-outer",
    OWN_VERDICTS: "srbval stability --verdicts",
    RIG_STABILITY: "srbval stability --scenes rig-outer",
}
SCHEMA_VERSION = 2
MOST_BYTES = 2**26  # the longest there are have some megabytes
RESULTS = "results"  # kind of content of the cache


@dataclass(frozen=True, kw_only=True)
class StoredResult:
    """A result file: where it lies and what is in it."""

    path: Path
    content: dict[str, Any]

    @property
    def made_utc(self) -> str:
        """When it was made, ISO 8601."""
        return str(self.content["made_utc"])

    @property
    def origin(self) -> dict[str, Any]:
        """Date, revision, command and machine, as the report states them."""
        machine = self.content.get("machine", {})
        return {
            "made_utc": self.made_utc,
            "git_revision": self.content.get("git_revision"),
            "command": self.content.get("command"),
            "processor": machine.get("processor"),
            "usable_cores": machine.get("usable_cores"),
            "file": self.path.name,
        }


def stamped(kind: str, result: Mapping[str, Any], *, command: str, revision: str | None) -> dict[str, Any]:
    """`result` with its kind, the date, the `command` that made it and the `revision` read when that began."""
    return {
        "schema_version": SCHEMA_VERSION,
        "kind": kind,
        "made_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "git_revision": revision,
        "command": command,
        **result,
    }


def store_result(content: Mapping[str, Any], path: Path | None = None) -> Path:
    """Write a stamped result to `path`, by default to the user's cache; `DataError` where that cannot be written."""
    path = path or cache_folder(RESULTS) / f"{content['kind']}.json"
    write_json(path, content)
    return path


def newest_result(kind: str) -> StoredResult | None:
    """The newest result of this kind in the user's cache, the repository or the installed package."""
    folders = (cache_folder(RESULTS), shipped_folder("reports"))
    found = [result for folder in folders if (result := _read(folder / f"{kind}.json", kind)) is not None]
    return max(found, key=lambda result: result.made_utc, default=None)


def _read(path: Path, kind: str) -> StoredResult | None:
    """A result file; None where there is none, or none that this version can read."""
    try:
        content = parse_json(read_small_file(path, MOST_BYTES))
    except (DataError, ValueError):
        return None
    fits = isinstance(content, dict) and content.get("kind") == kind and content.get("schema_version") == SCHEMA_VERSION
    fits = fits and isinstance(content.get("made_utc"), str) and isinstance(content.get("machine", {}), dict)
    return StoredResult(path=path, content=content) if fits else None
