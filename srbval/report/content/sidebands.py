"""Which sidebands the inner-race line carries: at the shaft speed, or at twice it."""

from __future__ import annotations

import numpy as np

from srbval.bearing import Fault
from srbval.evidence.gather import Evidence
from srbval.report.blocks import Paragraph
from srbval.report.content.names import SIDE_NAME
from srbval.validation.analyse import Analysis


def sideband_remark(evidence: Evidence) -> Paragraph:
    """Heights of the sidebands at one and two shaft speeds beside the line's own, model and rig."""
    height_mm = evidence.runs["paper-inner"].scene.defect.height_m * 1e3
    sides = (evidence.beside_rig[Fault.INNER], evidence.rig[Fault.INNER])
    texts = [f"{SIDE_NAME[a.recording.origin]}: {_heights(a)}" for a in sides]
    return Paragraph(
        "**Sidebands of the inner-race line**, as shares of the line itself, mean of both sides: "
        + "; ".join(texts)
        + ". A defect that only strikes in the load zone is modulated once a turn, at the shaft speed; "
        "one that strikes all "
        f"round, as a {height_mm:g} mm bump does, meets the sensor's axis twice a turn. The rig's defect is a drilled "
        "pit."
    )


def _heights(analysis: Analysis) -> str:
    line = analysis.line("BPFI").found_hz
    if line is None:
        return "line not read"
    shares = [_mean(analysis, line, k) / _at(analysis, line) for k in (1, 2)]
    return f"{shares[0]:.2f} at one shaft speed, {shares[1]:.2f} at two"


def _mean(analysis: Analysis, line_hz: float, times: int) -> float:
    offset = times * analysis.speed.value_hz
    return (_at(analysis, line_hz - offset) + _at(analysis, line_hz + offset)) / 2


def _at(analysis: Analysis, frequency_hz: float) -> float:
    spectrum = analysis.processed.spectrum
    nearest = np.argsort(np.abs(spectrum.frequency_hz - frequency_hz))[:2]
    return float(spectrum.amplitude[nearest].max())
