"""Differences of two records, each as one line of text, and which of them are allowed."""

import difflib
import math
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ALLOWED = Path(__file__).with_name("allowed_changes.toml")
# Values under these keys say when, where, how fast and by which version something was made: they are not compared.
VOLATILE = {
    "wall_s", "compile_s", "check_wall_s", "wall_per_simulated_s", "made_utc", "git_revision", "machine", "processor",
    "python", "packages", "usable_cores", "srbval", "version", "expected_s", "mtime_ns", "saves_pct",
}  # fmt: skip
# By what the entries of a list are matched, where no two have the same.
NAMES = (("id",), ("name",), ("kind", "scene", "used_for", "unit", "records"))


def differences(old: Any, new: Any, relative: float, where: str = "") -> Iterator[str]:
    """Each difference as ``where: what``; numbers may differ by `relative`, all else must be the same.

    Lists of texts are compared line by line, whatever their order; lists of tables by their entries' names where they
    have some.
    """
    if isinstance(old, dict) and isinstance(new, dict):
        for key in [key for key in {**old, **new} if key not in VOLATILE]:
            if key in old and key in new:
                yield from differences(old[key], new[key], relative, f"{where}/{key}")
            else:
                yield f"{where}/{key}: {'gone' if key in old else 'new'}: {_short((old if key in old else new)[key])}"
    elif isinstance(old, list) and isinstance(new, list):
        yield from _of_lists(old, new, relative, where)
    elif _is_number(old) and _is_number(new):
        if not (old == new or math.isclose(old, new, rel_tol=relative, abs_tol=0.0)):
            off = abs(new - old) / max(abs(old), abs(new))
            yield f"{where}: {old!r} -> {new!r} (relative {off:.1e})"
    elif type(old) is not type(new) or old != new:
        yield f"{where}: {_short(old)} -> {_short(new)}"


def _of_lists(old: list[Any], new: list[Any], relative: float, where: str) -> Iterator[str]:
    named = _by_name(old), _by_name(new)
    if all(isinstance(line, str) for line in (*old, *new)):
        gone, added = Counter(old) - Counter(new), Counter(new) - Counter(old)  # a line that moved is no difference
        for line in list(difflib.unified_diff(old, new, n=0, lineterm=""))[2:]:
            changed = {"-": gone, "+": added}.get(line[0], Counter())
            if changed[line[1:]]:
                changed[line[1:]] -= 1
                yield f"{where}: {line}"
    elif named[0] and named[1]:
        yield from differences(*named, relative, where)
    elif len(old) != len(new):
        yield f"{where}: {len(old)} entries -> {len(new)}"
    else:
        for i, pair in enumerate(zip(old, new, strict=True)):
            yield from differences(*pair, relative, f"{where}[{i}]")


def _by_name(entries: list[Any]) -> dict[str, Any] | None:
    for keys in NAMES:
        names = [[entry.get(key) for key in keys] for entry in entries if isinstance(entry, dict)]
        texts = [", ".join(map(str, name)) for name in names if isinstance(name[0], str)]
        if len(texts) == len(entries) == len(set(texts)):
            return dict(zip(texts, entries, strict=True))
    return None


def renamed(record: Any, names: dict[str, str]) -> Any:
    """The record with keys under their new names; `names`: ``parent/key`` to the new key."""
    if isinstance(record, list):
        return [renamed(entry, names) for entry in record]
    if not isinstance(record, dict):
        return record
    return {
        key: {names.get(f"{key}/{inner}", inner): renamed(value, names) for inner, value in entry.items()}
        if isinstance(entry, dict)
        else renamed(entry, names)
        for key, entry in record.items()
    }


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 160 else f"{text[:160]}..."


def renamed_keys() -> dict[str, str]:
    """Keys that have another name now, as ``parent/key`` to the new key."""
    return tomllib.loads(ALLOWED.read_text(encoding="utf-8")).get("renamed", {})


def allowed_changes() -> list[tuple[re.Pattern[str], str]]:
    """Patterns of differences that are wanted, with their reasons."""
    table = tomllib.loads(ALLOWED.read_text(encoding="utf-8"))
    return [(re.compile(entry["pattern"]), entry["reason"]) for entry in table.get("allowed", [])]
