"""Durations and repetitions of a benchmark."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class BenchSettings:
    """Durations in simulated seconds, and how often things are repeated.

    `timing_s` of each timed run, after `timing_settle_s`; `accuracy_s` of each run that is compared with the reference,
    after `accuracy_settle_s`; `memory_s` of the run whose memory is read; `reference_budget_s` wall time that one
    reference may take; `window_s` of the trajectories compared point by point; `steps` step sizes of the work-precision
    study, as divisors of a second.
    """

    timing_s: float
    timing_settle_s: float
    repeats: int
    accuracy_s: float
    accuracy_settle_s: float
    memory_s: float
    starts: int
    reference_budget_s: float
    window_s: float
    steps: tuple[int, ...]


FULL = BenchSettings(
    timing_s=0.3, timing_settle_s=0.1, repeats=5, accuracy_s=4.0, accuracy_settle_s=0.25, memory_s=10.0, starts=3,
    reference_budget_s=60.0, window_s=0.02, steps=(30720, 61440, 122880, 245760),
)  # fmt: skip
QUICK = BenchSettings(
    timing_s=0.05, timing_settle_s=0.05, repeats=2, accuracy_s=0.5, accuracy_settle_s=0.1, memory_s=1.0, starts=1,
    reference_budget_s=10.0, window_s=0.005, steps=(61440, 122880),
)  # fmt: skip
