"""A scene with a geometrically similar bearing: what other sizes of a bearing ask of a solver."""

from dataclasses import asdict, replace
from pathlib import Path

from srbval.bearing import load_bearing
from srbval.scene import Scene
from srbval.scene.similar import is_length, similar_parts


def similar(scene: Scene, size: float, folder: Path) -> Scene:
    """The scene of a geometrically similar bearing, its file in `folder`, at the same speed; see `scene.similar`."""
    return replace(similar_parts(scene, size), bearing=_similar_bearing(scene.bearing, size, folder))


def _similar_bearing(name: str, size: float, folder: Path) -> str:
    bearing = load_bearing(name)
    assert bearing.geometry is not None, "a scene of the bench has a bearing with one"
    path = folder / f"{Path(name).stem}-{size:g}.toml"
    if not path.exists():
        lengths = {
            key: value * size if is_length(key, value) else value for key, value in asdict(bearing.geometry).items()
        }
        lines = ['title = "similar"', f'source = "{size:g} times {bearing.title}"', "[geometry]"]
        path.write_text("\n".join(lines + [f"{key} = {value!r}" for key, value in lengths.items()]), encoding="utf-8")
    return str(path)
