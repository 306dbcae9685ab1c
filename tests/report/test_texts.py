"""Numbers in the texts of the report: what was computed or measured is passed in, never written down."""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import srbval

PACKAGE = Path(srbval.__file__).parent
FILES = [*PACKAGE.glob("report/texts/*.toml"), *PACKAGE.glob("studies/*/texts.toml")]
PASSED_IN = re.compile(r"\{\{.*?\}\}|\{%.*?%\}|`[^`]*`")
QUANTITY = re.compile(r"(?<!\w)\d[\d.,e-]*( to \d+)?( (%|dB|Hz|rpm|kN|kW|mm|µm|m/s²|µs|times|turns|orders|of \d+)|°)")
STATED = {  # what a text may state, for it is no result
    "95 %", "100 %", "45°", "1 m/s²",  # intervals, wholes; the sensor's place in the scene; a level's reference
    "1.5 times", "2 mm", "0.5 mm", "0.05 mm", "40.1 mm", "710 rpm", "0.1 Hz",  # printed in the paper
    "353 rpm", "877 rpm", "500 to 1500 Hz", "1400 to 2800 Hz", "400 to 3150 Hz",  # records; bands of analysis
    # limits and designs of studies, which are their questions and not their answers
    "1 %", "5 %", "95 to 110 %", "0.1 to 200 %", "98 %", "0.3 dB", "4 times", "3000 rpm", "30 turns",
}  # fmt: skip


def sentences(content: Any) -> Iterator[str]:
    """All texts of a file that a reader reads, but for the heads of columns."""
    if isinstance(content, str):
        yield content
    elif isinstance(content, list | dict):
        for key, value in content.items() if isinstance(content, dict) else enumerate(content):
            if key != "columns":
                yield from sentences(value)


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_texts_state_no_result(path: Path) -> None:
    for text in sentences(tomllib.loads(path.read_text(encoding="utf-8"))):
        found = {one[0] for one in QUANTITY.finditer(PASSED_IN.sub("", " ".join(text.split())))}
        assert not found - STATED, text
