"""The folder of a campaign that has ended, whole and as a copy to damage."""

import shutil
from pathlib import Path

import pytest

from srbval.campaign.folder import verify_campaign
from tests.campaign.campaigns import resume


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "run"
    found, _ = resume(folder)
    assert (found["cases"], found["done"], found["ran"]) == (6, 6, 5)
    reasons = {entry["case"]: (entry["ending"], entry["reason"]) for entry in found["failed"]}
    assert [(case, ending) for case, (ending, _) in reasons.items()] == [(3, "failed"), (4, "refused"), (5, "refused")]
    assert ": " in reasons[3][1]  # after the status of the run
    assert "radial_n = -3000 " in reasons[4][1]
    assert "has no [geometry]" in reasons[5][1]
    assert verify_campaign(folder)["ok"]
    return folder


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "run"))
