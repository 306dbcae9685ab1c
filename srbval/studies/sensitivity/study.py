"""What open inputs, starts and numerics do to every compared quantity of the paper's scene, or of a user's."""

from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path

from srbval.comparison.budget import STUDY as SIZE
from srbval.progress import Progress
from srbval.scene import load_scene
from srbval.storage.json_files import to_json
from srbval.studies.harness import StudyResult, printed_columns
from srbval.studies.input_effects import measure

FEW_DRAWS = 16  # of the open inputs with --quick


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    found = measure(
        scene=load_scene(options.scene) if options.scene else None,
        inputs=Path(options.inputs) if options.inputs else None,
        draws=FEW_DRAWS if options.quick else SIZE.draws,
        progress=progress,
    )
    content, parts = to_json(found), []
    for defect in content["defects"]:
        extra = ", in more than one round, since the emulator missed too many" if defect["refined"] else ""
        rows = [row | {"most_by": _most_by(row["shares"])} for row in defect["quantities"]]
        head = f"{defect['defect']}: {defect['draws']} draws of all inputs{extra}; {defect['failed']} failed"
        parts.append(f"{head}\n\n{printed_columns(__package__, 'quantities', rows)}")
    name = None if options.quick or options.scene or options.inputs else "sensitivity"
    return StudyResult(name=name, content=content, text="\n\n".join(parts))


def _most_by(shares: Mapping[str, float]) -> str:
    """The two inputs that settle most of the variance on their own."""
    most = sorted(shares, key=lambda name: -shares[name])[:2]
    return ", ".join(f"{name} {100 * shares[name]:.0f} %" for name in most)
