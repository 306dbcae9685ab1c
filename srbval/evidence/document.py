"""The evidence as the content of ``report.json``."""

from __future__ import annotations

import dataclasses
from typing import Any

from srbval.evidence.bands import RecordKurtogram
from srbval.evidence.bearing_views import LoadZone
from srbval.evidence.evidence import Evidence
from srbval.storage.stored_result import CAMPAIGN_SCALE, NOISE_STUDY, READING, SPEED_ACCURACY, STABILITY

SCHEMA_VERSION = 1
TIMED = ("wall_per_simulated_s",)  # what differs from one run to the next is not written
READING_KEYS = ("accuracy", "false_alarms", "timings", "chains", "transforms")


def document(evidence: Evidence) -> dict[str, Any]:
    """All numbers of the evidence; arrays that figures draw lie in the figures' data files."""
    content = {kind: result.content or {} for kind, result in evidence.results.items()}
    sides = {"paper": evidence.paper, "beside-rig": evidence.model_at_rig, "rig": evidence.rig}
    return {
        "schema_version": SCHEMA_VERSION,
        "status": "ok",
        "table6": evidence.rows,
        "closure": evidence.sums,
        "comparisons": evidence.comparisons,
        "bias": evidence.bias,
        "sensitivity": evidence.known.effects,
        "variations": evidence.variations,
        "analyses": {f"{name}-{state}": analysis for name, side in sides.items() for state, analysis in side.items()},
        "sidebands": evidence.sidebands,
        "load_zone": _load_zone(evidence.views.load_zone),
        "load_path": evidence.load_path,
        "point_passing": evidence.point_passing,
        "harmonic_patterns": evidence.patterns,
        "kurtograms": [_kurtogram(record) for record in evidence.kurtograms],
        "speed_accuracy": content[SPEED_ACCURACY].get("runs", []),
        "stability": content[STABILITY].get("cells", []),
        "kept_results": {kind: result.origin for kind, result in evidence.results.items() if result.origin},
        "ladder": evidence.ladder.rows,
        "detection_under_noise": content[NOISE_STUDY].get("rows", []),
        "reading": {key: content[READING].get(key, []) for key in READING_KEYS},
        "campaign_scale": content[CAMPAIGN_SCALE].get("reckoned", []),
        "matrix": evidence.matrix.cells,
        "crossed_bands": evidence.crossed,
        "other_rigs": evidence.other_rigs,
        "speed_and_slip": evidence.slips,
        "published_speeds": evidence.published_speeds,
        "single_speed": evidence.single_speed,
        "runs": [_fields(run, omitted=TIMED) for run in evidence.run_facts],
        "scene": evidence.scene_values,
        "recordings": evidence.registered,
    }


def _fields(instance: Any, *, omitted: tuple[str, ...]) -> dict[str, Any]:
    """The fields of a dataclass but the omitted ones."""
    return {f.name: getattr(instance, f.name) for f in dataclasses.fields(instance) if f.name not in omitted}


def _load_zone(zone: LoadZone) -> dict[str, Any]:
    return _fields(zone, omitted=("angle_deg", "outer_n", "inner_n"))


def _kurtogram(record: RecordKurtogram) -> dict[str, Any]:
    picture, second = record.kurtogram, record.second_comb
    return {
        "file": record.analysis.recording.file,
        "origin": record.analysis.recording.origin,
        "state": record.analysis.recording.state,
        "line": record.line,
        "band_hz": record.analysis.processed.band_hz,
        "most_impulsive_hz": picture.best_hz,
        "kurtosis_less_2": float(picture.kurtosis.max()),
        "bands": picture.size,
        "second_comb": None if second is None else second.line(record.line),
    }
