"""What figures and tables are given: names of lines and of tall peaks."""

from types import SimpleNamespace

import numpy as np

from srbval.comparison.table6 import table6
from srbval.report.findings.gather import at_drawn_points
from srbval.report.findings.records import fault_cursors, tall_peaks
from srbval.storage.stored_result import newest_result


def test_cursors_are_named_as_the_field_does():
    names = [c.name for c in fault_cursors("BPFI", 128.0, 270, sideband_hz=12.0, sidebands=1)]
    assert names == ["BPFI-fr", "BPFI", "BPFI+fr", "2xBPFI-fr", "2xBPFI", "2xBPFI+fr"]


def test_tall_peaks_are_named_by_what_they_are():
    frequency = np.arange(0, 6000) * 0.1
    height = np.full(frequency.size, 0.01)
    peaks = {11.83: "fr", 96.79: "BPFO", 193.58: "2xBPFO", 102.7: "BPFO+0.50fr", 340.0: "28.73fr", 256.08: None}
    for hz, tall in zip(peaks, (1.0, 0.9, 0.5, 0.6, 0.7, 1.0), strict=True):
        height[round(10 * hz)] = tall
    height[round(10 * 500.0)] = 0.3  # below a third of the tallest
    found = tall_peaks(
        frequency,
        height,
        600.0,
        shaft_hz=11.833,
        marked_hz=[128.04, 256.08],
        orders={"fr": 1.0, "BPFO": 8.1794, "BPFI": 10.8206, "FTF": 0.4305},
    )
    assert {round(hz, 1): name for name, hz, _ in found} == {round(hz, 1): n for hz, n in peaks.items() if n}
    assert [tall for _, _, tall in found] == sorted((tall for _, _, tall in found), reverse=True)


def test_a_record_at_a_speed_or_load_without_stored_draws_has_no_part_in_the_verdicts():
    points = ((124.8, 353.0), (124.8, 997.0), (62.4, 353.0))
    own, fast, light = (SimpleNamespace(radial_kn=kn, axial_kn=0.0, nominal_rpm=rpm) for kn, rpm in points)
    assert at_drawn_points([own, fast, light], table6(), newest_result("inputs").content) == [own]
    assert at_drawn_points([own, fast, light], table6(), {}) == [own, fast]
