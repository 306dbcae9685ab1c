"""Collect the tests of a study only if its folder exists."""

from pathlib import Path

from srbval.studies.harness import STUDIES_FOLDER

HERE = Path(__file__).parent


def _tested(path: Path) -> bool:
    """True if the study, or the shared module, after which a test file is named exists."""
    name = path.stem.removeprefix("test_")
    return (STUDIES_FOLDER / name).is_dir() or (STUDIES_FOLDER / f"{name}.py").is_file()


collect_ignore = [path.name for path in HERE.glob("test_*.py") if not _tested(path)]
