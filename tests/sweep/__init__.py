"""Tests of sweeps."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


@contextmanager
def stored_in(folder: Path) -> Iterator[None]:
    """Context in which results of scenes are stored in `folder`."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("srbval.storage.content_store.cache_folder", lambda _: folder)
        yield
