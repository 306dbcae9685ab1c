"""Paired kernel times of two checkouts."""

import statistics
from pathlib import Path

from tests.net.child import Checkout, scratch_folder

MODELS = {"full": "1.6276041666666666e-05", "line": "1.6276041666666666e-05", "slices": "2.44140625e-05"}
SECONDS = "4"


def compare_speed(old: Path, new: Path, *, pairs: int) -> None:
    """Run both in turn, first one, then the other first; print the median of the pairs' ratios, and their spread."""
    print("model   pairs  old s/s  new s/s  new/old: median, least, most")
    for model, step in MODELS.items():
        ratios, times = [], ([], [])
        for number in range(-1, pairs):  # the first pair compiles
            pair = {}
            for side in (0, 1) if number % 2 else (1, 0):
                pair[side] = _kernel_time((old, new)[side], model, step)
            if number >= 0:
                ratios.append(pair[1] / pair[0])
                for side in (0, 1):
                    times[side].append(pair[side])
        medians = [f"{statistics.median(side):7.4f}" for side in times]
        print(f"{model:7s} {pairs:5d}  {'  '.join(medians)}  {statistics.median(ratios):.4f}, "
              f"{min(ratios):.4f}, {max(ratios):.4f}", flush=True)  # fmt: skip


def _kernel_time(folder: Path, model: str, step: str) -> float:
    """Time per simulated second of the paper's scene with an outer-race defect, as the run itself states it."""
    with scratch_folder() as scratch:
        checkout = Checkout(folder.resolve(), Path(scratch).resolve())
        words = ["--model", model, "--solver", "imex2", "--defect", "outer", "--dt", step, "--seconds", SECONDS]
        ended = checkout.run("simulate", "--json", *words)
        return float(ended["out"]["wall_per_simulated_s"])
