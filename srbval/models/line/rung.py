"""The line rung: the full model's integration with patches for points."""

from __future__ import annotations

from collections.abc import Iterator

from srbval.models.chunk import Outputs
from srbval.models.line.parameters import line_parameters
from srbval.models.run_statistics import RunStatistics
from srbval.models.simulate import full_model


def run(stats: RunStatistics, settle: int, whole: int) -> Iterator[tuple[int, Outputs]]:
    """The rung, see `srbval.models.ladder`."""
    return full_model(stats, settle, whole, make=line_parameters)
