"""The rig's outer-race record: its most impulsive band shows another comb, and the report says so."""

import pytest

from srbval.bearing import load_bearing
from srbval.reading.analyse import analyse
from srbval.recordings import load_recording
from srbval.report.findings.bands import record_kurtogram
from srbval.report.sections.bands import two_combs

pytestmark = pytest.mark.recordings


def shown(folder, name, line):
    result = analyse(load_recording(folder / "torino" / f"{name}_877rpm_sample.mat"), bearing=load_bearing("skf-22240"))
    return record_kurtogram(result, line)


def test_outer_race_record_holds_two_combs_and_the_inner_one_does_not(recordings_dir):
    (remark,) = two_combs(shown(recordings_dir, "OR", "BPFO"))
    assert list(two_combs(shown(recordings_dir, "IR", "BPFI"))) == []
    assert remark.text.startswith("**Two combs in one record.** ")
    assert "BPFO reads 8.185" in remark.text
    assert "but 8.14" in remark.text


@pytest.mark.parametrize(("band_hz", "order"), [((5000.0, 7000.0), 8.1855), ((8000.0, 9000.0), 8.149)])
def test_either_comb_stands_in_several_bands_and_in_its_harmonics(recordings_dir, band_hz, order):
    result = analyse(
        load_recording(recordings_dir / "torino" / "OR_877rpm_sample.mat"), bearing=load_bearing("skf-22240"),
        band_hz=band_hz,
    )  # fmt: skip
    shown = [x for x in result.lines if x.name == "BPFO" and x.detected]
    assert len(shown) >= 4
    assert all(x.found_hz / x.harmonic / result.speed.value_hz == pytest.approx(order, abs=0.002) for x in shown)
