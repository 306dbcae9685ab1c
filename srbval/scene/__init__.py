"""What is to be run and what is asked of it: speed, loads, defect, duration, model, solver."""

from srbval.scene.bodies import Bodies, Housing
from srbval.scene.contact import Contact, RollerFit
from srbval.scene.defect import Defect, DefectShape
from srbval.scene.load import Load, LoadPath
from srbval.scene.profile import LoadProfile, SpeedProfile
from srbval.scene.read import load_scene, paper_scene
from srbval.scene.scene import Scene, SolverSettings

__all__ = [
    "Bodies",
    "Contact",
    "Defect",
    "DefectShape",
    "Housing",
    "Load",
    "LoadPath",
    "LoadProfile",
    "RollerFit",
    "Scene",
    "SolverSettings",
    "SpeedProfile",
    "load_scene",
    "paper_scene",
]
