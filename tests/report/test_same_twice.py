"""Two reports of the same recordings and runs are the same, byte for byte."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from srbval.storage.installation import child_environment

from .made import OPTIONS, Made

AGAIN = "import sys; from srbval.cli import main; sys.exit(main(sys.argv[1:]) not in (0, 1))"


@pytest.mark.long_form
def test_report_and_figures_are_the_same_from_a_process_that_hashes_its_own_way(with_rig: Made, tmp_path: Path) -> None:
    own = os.environ | child_environment() | {"SRBVAL_HOME": str(tmp_path), "PYTHONHASHSEED": "1"}
    own.pop("SRBVAL_RECORDINGS", None)
    subprocess.run([sys.executable, "-c", AGAIN, *OPTIONS], cwd=tmp_path, check=True, env=own)
    again = tmp_path / "made"
    assert (again / "report.json").read_bytes() == with_rig.files["json"].read_bytes()
    first, second = ({p.name: p.read_bytes() for p in (f / "figures").iterdir()} for f in (with_rig.folder, again))
    assert first
    assert first == second
