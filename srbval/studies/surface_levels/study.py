"""What a surface does to a healthy bearing's level: ``python -m srbval.studies.surface_levels.study``.

The scene `rig` at the speed of the rig's healthy record H 877, healthy, behind the bundled path to the sensor, with
surfaces of classes and heights, against that record. The path was fitted to H 877 and OR 877, so that nothing here is a
prediction; a class reaches waves of 1 to 50 mm by the power law alone, see ``theory/surface.md``.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from srbval.models.simulate import simulate
from srbval.path.amplitudes import RMS_BANDS, THIRD_OCTAVES, band_power, levels
from srbval.recordings import RecordingSettings, recording_from_run
from srbval.recordings.registry import load_registered
from srbval.scene import load_scene
from srbval.studies.rows import print_rows

HEALTHY = Path(__file__).parents[2] / "data_manifest" / "rig_excerpts" / "H_877rpm_sample.h5"
RPM = "858.489 rpm"  # mean of H 877 by its tachometer
CLASSES = ("N1", "N3")
HEIGHTS_NM = (14.0, 28.0, 56.0)


def surfaces() -> dict[str, dict[str, Any]]:
    """Surfaces by name: none, classes, heights of all bodies."""
    by_height = {
        f"{nm:g} nm": {f"{b}_waviness_m": nm * 1e-9 for b in ("outer", "inner", "roller")} for nm in HEIGHTS_NM
    }
    return {"round": {}} | {name: {"roughness_class": name} for name in CLASSES} | by_height


def main() -> None:
    """Print the RMS in each band of record and model, and the model's third octaves over the record's."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--only", nargs="*", default=None, help="names of surfaces")
    options = parser.parse_args()
    measured = load_registered(str(HEALTHY), RecordingSettings())
    rms_rows = [{"surface": "H 877, measured (fit)"} | rms(measured)]
    over = []
    for name, surface in surfaces().items():
        if options.only is not None and name not in options.only:
            continue
        changes: dict[str, Any] = {
            "shaft_speed": RPM, "duration": f"{options.seconds} s", "sensor_path": "rig", "seed": 1,
        }  # fmt: skip
        run = simulate(load_scene("rig", changes | ({"surface": surface} if surface else {})))
        recording = recording_from_run(run)
        print(f"{name}: {run.status}, energy imbalance {run.energy_imbalance:.2g}", flush=True)
        rms_rows.append({"surface": name} | rms(recording))
        ours, theirs = levels(recording, None), levels(measured, None)
        difference = {band: ours[band].value - theirs[band].value for band in THIRD_OCTAVES}
        over.append({"surface": name} | difference | {"mean dB": float(np.mean(list(difference.values())))})
    print("\nRMS in m/s2")
    print_rows(rms_rows)
    print("\nmodel over record, dB")
    print_rows(over)


def rms(recording: Any) -> dict[str, float]:
    """RMS in each band [m/s2]."""
    return {name: float(np.sqrt(band_power(recording, band))) for name, band in RMS_BANDS.items()}


if __name__ == "__main__":
    main()
