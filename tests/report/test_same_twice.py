"""Two reports of the same recordings and runs are the same, byte for byte."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from srbval.storage.installation import child_environment

from .made import OPTIONS, Made

# Runs that the figures show are those of the first report: that a simulation gives the same bits again is a matter of
# tests/models, and seen here in the counterparts of the other records.
AGAIN = """
import pickle, sys
from pathlib import Path
from srbval.cli import main
from srbval.report.findings import gather
runs, facts, models = pickle.loads(Path("runs.pickle").read_bytes())
simulated = gather.run_counterpart
gather._simulate = lambda *_: (runs, facts)
gather.run_counterpart = lambda rig, **given: models.get(rig.recording.name) or simulated(rig, **given)
sys.exit(main(sys.argv[1:]) not in (0, 1))
"""


@pytest.mark.long_form
def test_report_and_figures_are_the_same_from_a_process_that_hashes_its_own_way(with_rig: Made, tmp_path: Path) -> None:
    found = with_rig.findings
    models = {rig.recording.name: model for rig, model in found.matrix.sides.values()}
    facts = [fact for fact in found.run_facts if not fact["id"].startswith("counterpart")]
    runs = {fact["id"]: found.runs[fact["id"]] for fact in facts}
    (tmp_path / "runs.pickle").write_bytes(pickle.dumps((runs, facts, models)))
    own = os.environ | child_environment() | {"SRBVAL_HOME": str(tmp_path), "PYTHONHASHSEED": "1"}
    own.pop("SRBVAL_RECORDINGS", None)
    subprocess.run([sys.executable, "-c", AGAIN, *OPTIONS], cwd=tmp_path, check=True, env=own)
    again = tmp_path / "made"
    assert (again / "report.json").read_bytes() == with_rig.files["json"].read_bytes()
    first, second = ({p.name: p.read_bytes() for p in (f / "figures").iterdir()} for f in (with_rig.folder, again))
    assert first
    assert first == second
