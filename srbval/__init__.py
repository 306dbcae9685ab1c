"""Validate and benchmark simulated spherical-roller-bearing vibration against measured recordings.

The names below are loaded when they are first used, so that ``import srbval`` costs next to nothing::

    import srbval

    run = srbval.simulate(srbval.paper_scene(defect={"kind": "outer"}, duration="2 s"))
    analysis = srbval.analyse(srbval.recording_from_run(run), bearing=srbval.load_bearing("skf-22240"))
"""

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_NAMES = {
    "bearing": ("Bearing", "known_bearings", "load_bearing"),
    "scene": ("Scene", "load_scene", "paper_scene"),
    "models.run": ("Run", "RunStatus"),
    "models.simulate": ("simulate",),
    "models.run_file": ("write_run",),
    "recordings": ("Recording", "ShaftSpeed", "SpeedSource", "load_recording", "recording_from_run"),
    "signal": ("Spectrum",),
    "validation.analyse": ("Analysis", "analyse"),
    "evidence.evidence": ("Evidence",),
    "evidence.gather": ("gather",),
    "plan.plan": ("make_plan",),
    "check.check": ("run_check",),
    "main_job": ("make_report",),
    "errors": ("SrbvalError", "ConfigurationError", "DataError", "NumericsError"),
}
_HOME = {name: f"srbval.{module}" for module, names in _NAMES.items() for name in names}
__all__ = ["Analysis", "Bearing", "ConfigurationError", "DataError", "Evidence", "NumericsError", "Recording", "Run",
           "RunStatus", "Scene", "ShaftSpeed", "Spectrum", "SpeedSource", "SrbvalError", "__version__", "analyse",
           "gather", "known_bearings", "load_bearing", "load_recording", "load_scene", "make_plan", "make_report",
           "paper_scene", "recording_from_run", "run_check", "simulate", "write_run"]  # fmt: skip

if TYPE_CHECKING:
    from srbval.bearing import Bearing, known_bearings, load_bearing
    from srbval.check.check import run_check
    from srbval.errors import ConfigurationError, DataError, NumericsError, SrbvalError
    from srbval.evidence.evidence import Evidence
    from srbval.evidence.gather import gather
    from srbval.main_job import make_report
    from srbval.models.run import Run, RunStatus
    from srbval.models.run_file import write_run
    from srbval.models.simulate import simulate
    from srbval.plan.plan import make_plan
    from srbval.recordings import Recording, ShaftSpeed, SpeedSource, load_recording, recording_from_run
    from srbval.scene import Scene, load_scene, paper_scene
    from srbval.signal import Spectrum
    from srbval.validation.analyse import Analysis, analyse


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'srbval' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
