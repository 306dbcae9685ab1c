"""How far a run's measures are from a reference's."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import Any

from srbval.bench.measures import Measures


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Relative differences from a reference, without sign; None where one of the two lacks the quantity.

    `noise_floor_ratio` is the floor over the reference's; `harmonic_error` the largest difference in height of the
    defect line's harmonics, each over its first.
    """

    cage_error: float
    defect_hz_error: float | None
    noise_floor_ratio: float | None
    band_rms_error: float
    harmonic_error: float | None

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def errors_against(measures: Measures, reference: Measures) -> Errors:
    """Errors of `measures`; both from the same scene and duration."""
    own, right = measures.harmonics, reference.harmonics
    ratio = _ratio(measures.noise_floor, reference.noise_floor)
    defect = _ratio(measures.defect_hz, reference.defect_hz)
    return Errors(
        cage_error=abs(measures.cage_ratio / reference.cage_ratio - 1),
        defect_hz_error=None if defect is None else abs(defect - 1),
        noise_floor_ratio=ratio,
        band_rms_error=abs(measures.band_rms_m_s2 / reference.band_rms_m_s2 - 1),
        harmonic_error=max(abs(a - b) for a, b in zip(own, right, strict=True)) if own and right else None,
    )


def plain_or_nulls(part: Errors | Measures | None, kind: type[Errors] | type[Measures]) -> dict[str, Any]:
    """Plain values of `part`; the names of `kind` with None where there is none."""
    return dict.fromkeys(field.name for field in fields(kind)) if part is None else asdict(part)


def _ratio(value: float | None, reference: float | None) -> float | None:
    return None if value is None or reference is None else value / reference
