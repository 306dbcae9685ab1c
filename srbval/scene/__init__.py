"""What is to be run and what is asked of it: speed, loads, defect, duration, model, solver."""

from srbval.scene.read import load_scene, paper_scene
from srbval.scene.scene import (
    Bodies,
    Contact,
    Defect,
    DefectKind,
    Housing,
    Load,
    LoadPath,
    RollerFit,
    Scene,
    SolverSettings,
)

__all__ = [
    "Bodies",
    "Contact",
    "Defect",
    "DefectKind",
    "Housing",
    "Load",
    "LoadPath",
    "RollerFit",
    "Scene",
    "SolverSettings",
    "load_scene",
    "paper_scene",
]
