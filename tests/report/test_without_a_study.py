"""Without the folder of any one study, the rest of the program imports and the report has every other page."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import srbval
from srbval.studies.harness import pages, study_names

PACKAGE = Path(srbval.__file__).parent
ASSEMBLE = """
import srbval.cli, srbval.report.reports
from srbval.report.pages import joined_data, results_of
from srbval.studies.harness import pages, study_names
found = pages()
results = results_of(found)
sections = {(section := page.section(results)).id: section for page in found}
assert len(sections) == len(found) and all(section.blocks for section in sections.values())
joined_data({}, (page.data(results) for page in found))
print(",".join(page.name for page in found), ",".join(study_names()))
"""


def without(study: str, folder: Path) -> Path:
    """A copy of the package in which one study's folder is missing, and links to what ships beside it."""
    left_out = shutil.ignore_patterns("__pycache__", "docs")
    shutil.copytree(PACKAGE, folder / PACKAGE.name, ignore=left_out)
    shutil.rmtree(folder / PACKAGE.name / "studies" / study)
    for name in ("reports", "data_manifest"):
        (folder / name).symlink_to(PACKAGE.parent / name)
    return folder


@pytest.mark.parametrize("study", study_names())
def test_the_report_is_without_the_page_of_a_study_that_is_not_there_and_the_rest_stays(
    study: str, tmp_path: Path
) -> None:
    tree = without(study, tmp_path)
    done = subprocess.run(
        [sys.executable, "-c", ASSEMBLE],
        cwd=tree,
        env=os.environ | {"PYTHONPATH": str(tree)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    shown, left = (names.split(",") for names in done.stdout.split())
    assert left == [name for name in study_names() if name != study]
    assert shown == [page.name for page in pages() if page.name != study]
