"""What a surface does to a healthy bearing's level.

The scene `rig` at the speed of the rig's healthy record H 877, healthy, behind the bundled path to the sensor, with
surfaces of classes and heights, against that record. The path was fitted to H 877 and OR 877, so that nothing here is a
prediction; a class reaches waves of 1 to 50 mm by the power law alone, see ``theory/surface.md``.
"""

from argparse import ArgumentParser, Namespace
from typing import Any

import numpy as np

from srbval.models.simulate import simulate
from srbval.path.amplitudes import RMS_BANDS, THIRD_OCTAVES, band_power, levels
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.recordings import RecordingSettings, recording_from_run
from srbval.recordings.registry import load_registered
from srbval.scene import load_scene
from srbval.storage.installation import shipped_folder
from srbval.studies.harness import Study, StudyResult

HEALTHY = "rig_excerpts/H_877rpm_sample.h5"
RPM = "858.489 rpm"  # mean of H 877 by its tachometer
CLASSES = ("N1", "N3")
HEIGHTS_NM = (14.0, 28.0, 56.0)


def surfaces() -> dict[str, dict[str, Any]]:
    """Surfaces by name: none, classes, heights of all bodies."""
    by_height = {
        f"{nm:g} nm": {f"{b}_waviness_m": nm * 1e-9 for b in ("outer", "inner", "roller")} for nm in HEIGHTS_NM
    }
    return {"round": {}} | {name: {"roughness_class": name} for name in CLASSES} | by_height


def rms(recording: Any) -> dict[str, float]:
    """RMS in each band [m/s2]."""
    return {name: float(np.sqrt(band_power(recording, band))) for name, band in RMS_BANDS.items()}


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--seconds", metavar="S", type="positive", default=2.0, help="of each run (default: 2)")
    parser.add_argument("--only", metavar="NAME", nargs="*", help="names of surfaces (default: all)")


def _run(options: Namespace, progress: Progress) -> StudyResult:
    measured = load_registered(str(shipped_folder("data_manifest") / HEALTHY), RecordingSettings())
    rms_rows: list[dict[str, Any]] = [{"surface": "H 877, measured (fit)", **rms(measured)}]
    over: list[dict[str, Any]] = []
    wanted = {name: one for name, one in surfaces().items() if options.only is None or name in options.only}
    for number, (name, surface) in enumerate(wanted.items()):
        progress(name, number / len(wanted))
        changes: dict[str, Any] = {
            "shaft_speed": RPM, "duration": f"{options.seconds} s", "sensor_path": "rig", "seed": 1,
        }  # fmt: skip
        run = simulate(load_scene("rig", changes | ({"surface": surface} if surface else {})))
        recording = recording_from_run(run)
        rms_rows.append({"surface": name, **rms(recording), "status": run.status})
        ours, theirs = levels(recording, None), levels(measured, None)
        difference = {band: ours[band].value - theirs[band].value for band in THIRD_OCTAVES}
        over.append({"surface": name, **difference, "mean dB": float(np.mean(list(difference.values())))})
    progress("surfaces", 1.0)
    shown = [{**row, "status": row.get("status", "")} for row in rms_rows]
    text = f"RMS in m/s2\n{text_rows(shown)}\n\nmodel over record, dB\n{text_rows(over)}"
    stored = None if options.only else "surface_levels"
    return StudyResult(name=stored, content={"rms": rms_rows, "model_over_record_db": over}, text=text)


STUDY = Study(
    question="What does a surface's roughness do to a healthy bearing's level?", minutes=5, run=_run, options=_options
)
