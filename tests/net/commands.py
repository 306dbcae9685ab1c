"""Items `cli`, `hostile` and `check`: help texts, exit codes and messages of right and wrong uses."""

import re
import shlex
from pathlib import Path
from typing import Any

from tests.net.child import Checkout, with_json
from tests.net.hostile import write_corpus, write_sample

USES = Path(__file__).with_name("uses.txt")
NAME = re.compile(r"^  ( {2})?([a-z]+)(?: |$)", re.MULTILINE)  # of a command or an action, in a help text
READ = ("--rpm", "710", "--fs", "4096", "--unit", "m/s2", "--bearing", "skf-22240", "--band", "800", "1600")


def record_uses(checkout: Checkout) -> dict[str, Any]:
    """Help of every command and action, found from help to help; then every line of ``uses.txt``."""
    found, waiting = {}, [()]
    while waiting:
        words = waiting.pop(0)
        ended = found[f"help {' '.join(words)}".strip()] = checkout.run(*words, "--help")
        if len(words) < 2:
            waiting += [(*words, name) for name in _named(ended["out"])]
    write_sample(checkout.scratch)
    for line in USES.read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            found[line] = checkout.run(*shlex.split(line))
    return found


def _named(lines: list[str]) -> list[str]:
    """Commands or actions that a help text lists: below its positional arguments, indented by four."""
    text = "\n".join(lines).partition("positional arguments:")[2].partition("\noptions:")[0]
    return [name for deeper, name in NAME.findall(text) if deeper]


def record_hostile(checkout: Checkout) -> dict[str, Any]:
    """``srbval analyse`` of damaged and odd files."""
    files = write_corpus(checkout.scratch)
    return {file: checkout.run(*with_json(["analyse", file, *READ])) for file in files}


def record_check(checkout: Checkout) -> dict[str, Any]:
    """``srbval check``."""
    return {"check": checkout.run("check", "--json")}
