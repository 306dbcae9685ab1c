"""What counts as shown on records of other rigs."""

from __future__ import annotations

import dataclasses

from srbval.bearing import Fault
from srbval.comparison.other_rigs import _shown
from tests.diagnosis.test_fault_call import faulted_analysis


def test_a_healthy_record_s_deepest_line_does_not_hide_another_that_is_like_a_fault_s() -> None:
    """The outer race's smooth, the inner race's struck and less deep."""
    depths = {("BPFO", 1): 0.9, ("BPFO", 2): 0.1, ("BPFI", 1): 0.6}
    analysis = faulted_analysis()
    lines = tuple(
        dataclasses.replace(x, depth=depths.get((x.name, x.harmonic)), detected=(x.name, x.harmonic) in depths)
        for x in analysis.lines
    )
    both = dataclasses.replace(analysis, lines=lines)
    assert _shown(both, both.line("BPFO"), Fault.HEALTHY)
    smooth = tuple(dataclasses.replace(x, depth=None, detected=False) if x.name == "BPFI" else x for x in lines)
    alone = dataclasses.replace(analysis, lines=smooth)
    assert not _shown(alone, alone.line("BPFO"), Fault.HEALTHY)
