"""Plans, journals and campaign files in which anything may stand.

`SRBVAL_JOURNALS` is the number of hostile folders (1000 take some minutes).
"""

from __future__ import annotations

import hashlib
import json
import os
import random
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from srbval.campaign.folder import PLAN
from srbval.campaign.status import verify_campaign
from srbval.cli import main
from srbval.errors import SrbvalError
from tests.campaign.mixed_folder import resume
from tests.campaign.small import content

JOURNALS = int(os.environ.get("SRBVAL_JOURNALS", "60"))
HANG_S = 60  # for one command on a folder of six cases, none of which is run; they take a tenth of a second
DEEP = "[" * 20_000 + "]" * 20_000
VALUES = [f"1{'0' * 5000}", f"1{'0' * 400}", "1e400", "-1", "0.5", "NaN", DEEP, "[" * 40 + "]" * 40, '"\\ud800"',
          '"\\u0000"', '"../victim"', '"/etc/passwd"', f'"{"a" * 32}"', "null", "true", "[]", "{}",
          '"\\u001b[2J"', '{"a": {"b": 1}}', '"' + "x" * 100_000 + '"']  # fmt: skip
BROKEN = [b"", b"\0" * 100, b"\xff\xfe{}", b"{", b"[]", b"null", b'{"check": "' + b"0" * 32 + b'"}']


def hostile_line(line: bytes, chance: random.Random) -> bytes:
    """A line with another value or key, and mostly the right check value."""
    document = json.loads(line)
    document.pop("check")
    ((_, table),) = document.items()
    key = chance.choice(list(table))
    marker = "<value>"
    kind = chance.randrange(4)
    if kind == 0:
        return chance.choice(BROKEN)
    if kind == 1:
        del table[key]
        table |= {"other": 1}
    elif kind == 2 and isinstance(table.get("point"), dict):
        table["point"] = {chance.choice(["a", "\0", "../x", "\ud800"]): marker}
    else:
        table[key] = marker
    text = json.dumps(document).replace(f'"{marker}"', chance.choice(VALUES)).removesuffix("}").encode()
    check = hashlib.sha256(text).hexdigest()[:32].encode() if chance.random() < 0.9 else b"0" * 32
    return text + b', "check": "' + check + b'"}'


@pytest.fixture
def _no_hang() -> Iterator[None]:
    """End the test where one command takes longer than `HANG_S`."""

    def hang(*_: object) -> None:
        raise AssertionError(f"longer than {HANG_S} s")

    before = signal.signal(signal.SIGALRM, hang)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("_no_hang")
@pytest.mark.skipif(not hasattr(signal, "alarm"), reason="no alarm here")
def test_hostile_plans_and_journals(whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Whatever stands in them: an answer or an error of ours, and nothing outside the folder is touched."""
    chance = random.Random(JOURNALS)
    outside = tmp_path / "outside"
    folder = outside / "run"
    shutil.copytree(whole, folder)
    for name in ("victim.h5", "victim", f"{'a' * 32}.h5", "cases/victim.h5"):
        (outside / name).parent.mkdir(exist_ok=True)
        (outside / name).write_text("mine")
    codes: dict[str, int] = {}
    for _ in range(JOURNALS):
        lines = (whole / PLAN).read_bytes().splitlines()
        for at in chance.sample(range(len(lines)), chance.choice([1, 1, 2])):
            lines[at] = hostile_line(lines[at], chance)
        (folder / PLAN).write_bytes(b"\n".join(lines) + chance.choice([b"\n", b""]))
        for command in (["status", str(folder)], ["verify", str(folder)], ["verify", str(folder), "--json"]):
            signal.alarm(HANG_S)
            code = main(["campaign", *command])
            assert code in (0, 1, 3), command
            codes[f"{command[0]} {code}"] = codes.get(f"{command[0]} {code}", 0) + 1
        signal.alarm(HANG_S)
        try:
            found, _said = resume(folder)
            assert (found.done, found.ran) == (6, 0)
            assert verify_campaign(folder).ok
            assert content(folder) == content(whole)
            ended = "run 0"
        except SrbvalError as error:
            ended = f"run {error.exit_code}"
            shutil.rmtree(folder)
            shutil.copytree(whole, folder)
        codes[ended] = codes.get(ended, 0) + 1
        signal.alarm(0)
        assert {path.read_text() for path in outside.rglob("*") if path.is_file() and folder not in path.parents} == {
            "mine"
        }
        assert sorted(path.name for path in outside.iterdir()) == sorted(
            ["victim.h5", "victim", f"{'a' * 32}.h5", "cases", "run"]
        )
    capsys.readouterr()
    with capsys.disabled():
        print(f"\n{JOURNALS} hostile folders: {dict(sorted(codes.items()))}")
    assert sum(codes.values()) == 4 * JOURNALS
