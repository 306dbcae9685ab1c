"""A scene with a geometrically similar bearing: what other sizes of a bearing ask of a solver."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from srbval.bearing import load_bearing
from srbval.scene import Scene


def similar(scene: Scene, size: float, folder: Path) -> Scene:
    """The scene of a geometrically similar bearing, its file in `folder`, at the same shaft speed.

    Lengths go with the size, forces and dampings with its square, masses with its cube, stiffnesses with itself: times
    of the elastic bodies then go with the size, and stresses stay. The friction law's velocity stays as well.
    """
    contact, housing, bodies, defect, load = scene.contact, scene.housing, scene.bodies, scene.defect, scene.load
    return replace(
        scene,
        bearing=_similar_bearing(scene.bearing, size, folder),
        load=replace(load, radial_n=load.radial_n * size**2, axial_n=load.axial_n * size**2),
        contact=replace(
            contact, stiffness_n_m=contact.stiffness_n_m * size, damping_ns_m=contact.damping_ns_m * size**2,
            smoothing_width_m=contact.smoothing_width_m * size, radial_play_m=contact.radial_play_m * size,
        ),
        housing=replace(
            housing, mass_kg=housing.mass_kg * size**3, stiffness_n_m=housing.stiffness_n_m * size,
            damping_ns_m=housing.damping_ns_m * size**2,
        ),
        bodies=replace(bodies, cage_mass_kg=bodies.cage_mass_kg * size**3),
        defect=replace(defect, **{key: value * size for key, value in vars(defect).items() if _is_length(key, value)}),
    )  # fmt: skip


def _is_length(key: str, value: Any) -> bool:
    return key.endswith("_m") and value is not None


def _similar_bearing(name: str, size: float, folder: Path) -> str:
    bearing = load_bearing(name)
    assert bearing.geometry is not None, "a scene of the bench has a bearing with one"
    path = folder / f"{Path(name).stem}-{size:g}.toml"
    if not path.exists():
        lengths = {
            key: value * size if _is_length(key, value) else value for key, value in asdict(bearing.geometry).items()
        }
        lines = ['title = "similar"', f'source = "{size:g} times {bearing.title}"', "[geometry]"]
        path.write_text("\n".join(lines + [f"{key} = {value!r}" for key, value in lengths.items()]), encoding="utf-8")
    return str(path)
