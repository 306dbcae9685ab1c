"""The folder of a campaign that has ended, whole and as a copy to damage."""

import shutil
from pathlib import Path

import pytest

from srbval.campaign.run import verify_campaign
from tests.campaign.campaigns import resume


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "run"
    found = resume(folder)
    assert (found["cases"], found["done"], found["ran"]) == (6, 6, 5)
    failed = [(entry["case"], entry["status"]) for entry in found["failed"]]
    assert failed == [(3, "load-lost"), (4, "refused"), (5, "refused")]
    _, negative, without_geometry = (entry["reason"] for entry in found["failed"])
    assert "radial_n = -3000 " in negative
    assert "has no [geometry]" in without_geometry
    assert verify_campaign(folder)["ok"]
    return folder


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "run"))
