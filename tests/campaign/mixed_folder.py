"""A campaign of good, lost and refused cases, its folder, and what can happen to a file in it."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

from srbval.campaign.run import run_campaign
from srbval.campaign.settings import Campaign
from srbval.campaign.status import verify_campaign
from tests.campaign.in_process import InProcess
from tests.campaign.small import failing_point, small

POINTS = [{"defect.kind": "outer", "model": "planar"}, {"defect.kind": "inner", "model": "kinematic"},
          {"model": "planar"}, failing_point() | {"model": "full"}, {"load.radial": "-3 kN"},
          {"bearing": "skf-6205", "model": "full"}]  # fmt: skip
AXES = [{"kind": "list", "cases": POINTS}]


def mixed(**changes: Any) -> Campaign:
    """Three good cases with signals, one that the numerics lose, two that are refused."""
    return small(axes=AXES, **changes)


def resume(folder: Path, **changes: Any) -> tuple[Any, list[str]]:
    said: list[str] = []
    return run_campaign(mixed(**changes), folder, engine=InProcess(), message=said.append), said


def files_of(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file() and path.name != "lock")


def good_results(folder: Path) -> list[Path]:
    return sorted(path for path in (folder / "cases").glob("*/*.h5") if path.stat().st_size > 20_000)


def damaged_names(folder: Path) -> set[str]:
    return {found.file.name for found in verify_campaign(folder).damaged}


def flip(content: bytes, chance: random.Random) -> bytes:
    raw = bytearray(content)
    raw[chance.randrange(len(raw))] ^= 1 << chance.randrange(8)
    return bytes(raw)


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def add_zeros(path: Path) -> None:
    path.write_bytes(path.read_bytes() + bytes(100))
