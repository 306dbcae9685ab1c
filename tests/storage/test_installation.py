"""The package finds itself, what is shipped with it, and itself again in a child process."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import srbval
from srbval.errors import DataError
from srbval.storage.installation import child_environment, shipped_folder

HERE = Path(srbval.__file__).parent


def test_what_is_shipped_is_found() -> None:
    assert all(any(shipped_folder(name).iterdir()) for name in ("data_manifest/rig_excerpts", "reports"))
    with pytest.raises(DataError, match="incomplete"):
        shipped_folder("no_such_folder")


def test_a_child_process_imports_this_very_package(tmp_path: Path) -> None:
    found = subprocess.run(
        [sys.executable, "-P", "-c", "import srbval; print(srbval.__file__)"],
        env=os.environ | child_environment(), cwd=tmp_path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert Path(found.stdout.strip()).parent == HERE
