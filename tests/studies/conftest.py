"""Tests of a study are collected where its folder is: without the folder nothing is said of it."""

from pathlib import Path

from srbval.studies.harness import FOLDER

HERE = Path(__file__).parent


def _tested(path: Path) -> bool:
    """Is what a file is named after there, a study's folder or a module that several studies share?"""
    name = path.stem.removeprefix("test_")
    return (FOLDER / name).is_dir() or (FOLDER / f"{name}.py").is_file()


collect_ignore = [path.name for path in HERE.glob("test_*.py") if not _tested(path)]
