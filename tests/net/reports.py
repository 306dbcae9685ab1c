"""Item `report`: the main report and reports on recordings; their data, which tests/report holds their pages to."""

import json
import tomllib
from typing import Any

from tests.net.child import Checkout, recordings_folder
from tests.net.recorded import CASES


def record(checkout: Checkout) -> dict[str, Any]:
    """The main report with its appendix, one run at a time, and those that ``recordings.toml`` names."""
    folder, found = recordings_folder(), {}
    found["main"] = _report(checkout, "main", ["--jobs", "1"])
    for data_set, known in tomllib.loads(CASES.read_text(encoding="utf-8")).items():
        for number, case in enumerate(known.get("reports", [])):
            words = [str(folder / data_set / file) for file in case["files"]] + known.get("options", [])
            if "healthy" in case:
                words += ["--healthy", str(folder / data_set / case["healthy"])]
            if (folder / data_set).is_dir():
                name = f"{data_set}-{number}"
                found[name] = _report(checkout, name, words)
    return found


def _report(checkout: Checkout, name: str, words: list[str]) -> dict[str, Any]:
    ended = checkout.run("report", "--json", "--no-pdf", "--appendix", "-o", name, *words)
    made = checkout.scratch / name
    found = {"command": ended, "files": sorted(p.relative_to(made).as_posix() for p in made.rglob("*") if p.is_file())}
    if (made / "report.json").exists():
        found["json"] = checkout.comparable(json.loads((made / "report.json").read_text(encoding="utf-8")))
    return found
