"""Validate and benchmark simulated spherical-roller-bearing vibration against measured recordings.

The names below are loaded when they are first used, so that ``import srbval`` costs next to nothing::

    import srbval

    run = srbval.simulate(srbval.paper_scene(defect={"kind": "outer"}, duration="2 s"))
    analysis = srbval.analyse(srbval.recording_from_run(run), bearing=srbval.load_bearing("skf-22240"))
"""

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "Bearing": "srbval.bearing",
    "load_bearing": "srbval.bearing",
    "known_bearings": "srbval.bearing",
    "Scene": "srbval.scene",
    "load_scene": "srbval.scene",
    "paper_scene": "srbval.scene",
    "Run": "srbval.models.run",
    "RunStatus": "srbval.models.run",
    "simulate": "srbval.models.simulate",
    "write_run": "srbval.models.run_file",
    "Recording": "srbval.recordings",
    "ShaftSpeed": "srbval.recordings",
    "SpeedSource": "srbval.recordings",
    "load_recording": "srbval.recordings",
    "recording_from_run": "srbval.recordings",
    "Spectrum": "srbval.signal",
    "Analysis": "srbval.validation.analyse",
    "analyse": "srbval.validation.analyse",
    "Evidence": "srbval.evidence.evidence",
    "gather": "srbval.evidence.gather",
    "make_plan": "srbval.plan.plan",
    "run_check": "srbval.check.check",
    "make_report": "srbval.main_job",
    "SrbvalError": "srbval.errors",
    "ConfigurationError": "srbval.errors",
    "DataError": "srbval.errors",
    "NumericsError": "srbval.errors",
}
__all__ = [
    "Analysis",
    "Bearing",
    "ConfigurationError",
    "DataError",
    "Evidence",
    "NumericsError",
    "Recording",
    "Run",
    "RunStatus",
    "Scene",
    "ShaftSpeed",
    "Spectrum",
    "SpeedSource",
    "SrbvalError",
    "__version__",
    "analyse",
    "gather",
    "known_bearings",
    "load_bearing",
    "load_recording",
    "load_scene",
    "make_plan",
    "make_report",
    "paper_scene",
    "recording_from_run",
    "run_check",
    "simulate",
    "write_run",
]

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
