"""Where this user's data lies."""

from __future__ import annotations

import os
from pathlib import Path

from srbval.errors import DataError

HOME_VARIABLE = "SRBVAL_HOME"
RECORDINGS_VARIABLE = "SRBVAL_RECORDINGS"


def home_folder() -> Path:
    """The folder of the manifest and of downloads: ``$SRBVAL_HOME``, else the platform's own place."""
    set_by_user = os.environ.get(HOME_VARIABLE)
    if set_by_user:
        return Path(set_by_user).expanduser()
    import platformdirs

    return Path(platformdirs.user_data_dir("srbval"))


def recordings_folder() -> Path | None:
    """The folder ``$SRBVAL_RECORDINGS`` names, used without being registered; `DataError` if it is not there."""
    set_by_user = os.environ.get(RECORDINGS_VARIABLE)
    if not set_by_user:
        return None
    folder = Path(set_by_user).expanduser()
    if not folder.is_dir():
        raise DataError(f"{RECORDINGS_VARIABLE} is {set_by_user!r}, no folder. Correct it or unset it.")
    return folder
