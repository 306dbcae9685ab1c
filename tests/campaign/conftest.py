"""The folder of a campaign that has ended, whole and as a copy to damage."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from srbval.campaign.run import run_campaign
from srbval.campaign.status import verify_campaign
from tests.campaign.in_process import InProcess
from tests.campaign.mixed_folder import mixed


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "run"
    found = run_campaign(mixed(), folder, engine=InProcess())
    assert (found.done, len(found.failed)) == (6, 3)
    assert verify_campaign(folder).ok
    return folder


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "run"))
