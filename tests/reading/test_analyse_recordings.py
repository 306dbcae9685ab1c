"""`analyse` on measured recordings: the right race line, with no option but the file."""

import pytest

from srbval.bearing import load_bearing
from srbval.comparison.speed_and_slip import cage_factor
from srbval.reading.analyse import analyse
from srbval.recordings import SpeedSource, load_recording

pytestmark = pytest.mark.recordings

# Orders read by an independent prototype from the same files (five-harmonic fit, squared envelope).
ORDER_TOLERANCE = 1e-3
RACE_LINES = {"BPFO", "BPFI"}
LARGEST_DEVIATION_PCT = 0.5  # of a line from kinematics at the record's own speed, under load: what slip leaves


def analysed(folder, name):
    path = folder / name
    if not path.is_file():
        pytest.skip(f"{name} is not among the recordings")
    recording = load_recording(path)
    return analyse(recording, bearing=load_bearing(recording.bearing))


def race_lines(analysis):
    lines = [line for line in analysis.lines if line.name in RACE_LINES and line.harmonic == 1 and line.detected]
    return [line.name for line in sorted(lines, key=lambda line: -line.depth)]


@pytest.mark.parametrize(
    ("name", "line", "order"),
    [("torino/OR_877rpm_sample.mat", "BPFO", 8.186), ("torino/IR_877rpm_sample.mat", "BPFI", 10.817)],
)
def test_rig_orders_with_the_tachometer_s_speed(recordings_dir, name, line, order):
    result = analysed(recordings_dir, name)
    assert result.speed.source.value == "tachometer"
    assert result.line(line).detected
    assert result.line(line).found_hz / result.speed.value_hz == pytest.approx(order, rel=ORDER_TOLERANCE)


def test_rig_inner_race_record_closes_on_nineteen_rollers(recordings_dir):
    closure = analysed(recordings_dir, "torino/IR_877rpm_sample.mat").closure
    assert closure.closed
    assert abs(closure.difference_pct) < 0.1


@pytest.mark.parametrize(
    ("name", "line", "other"),
    [
        ("cwru/105_IR007_0_12kDE.mat", "BPFI", 0),
        ("cwru/109_IR007_0_48kDE.mat", "BPFI", None),
        ("cwru/278_IR007_0_12kFE.mat", "BPFI", None),
        ("cwru/130_OR007at6_0_12kDE.mat", "BPFO", 0),  # carries a strong line at 3/2 BPFO, in the window of BPFI
        ("cwru/135_OR007at6_0_48kDE.mat", "BPFO", None),
        ("cwru/294_OR007at6_0_12kFE.mat", "BPFO", None),
        # Y by a plain envelope in table B2 of Smith & Randall (2015), Mech. Syst. Signal Process. 64-65, 100.
        ("cwru/106_IR007_1_12kDE.mat", "BPFI", None),
        ("cwru/131_OR007at6_1_12kDE.mat", "BPFO", None),
        ("cwru/144_OR007at3_0_12kDE.mat", "BPFO", None),
        ("cwru/169_IR014_0_12kDE.mat", "BPFI", None),
        ("cwru/209_IR021_0_12kDE.mat", "BPFI", None),
        ("cwru/234_OR021at6_0_12kDE.mat", "BPFO", None),
        *((f"mfpt/InnerRaceFault_vload_{n}.mat", "BPFI", 0 if n == 3 else None) for n in (1, 3, 5, 7)),
        *((f"mfpt/OuterRaceFault_vload_{n}.mat", "BPFO", 0 if n == 1 else None) for n in (1, 3, 5)),
        ("hit_sm/Self-built/IR5_1200.mat", "BPFI", None),
        ("hit_sm/SpectraQuest/OR5_1200.mat", "BPFO", None),
        ("torino/OR_877rpm_sample.mat", "BPFO", 0),
    ],
)
def test_right_race_line_is_the_strongest_and_named(recordings_dir, name, line, other):
    """`other`: the number of lines of the other race, where there must be none."""
    result = analysed(recordings_dir, name)
    first, *others = race_lines(result)
    assert first == line
    assert other is None or len(others) == other
    assert result.summary.startswith(line)
    assert result.line(line).depth > (0.4 if name.startswith("torino/") else 0.5)
    if result.speed.source is not SpeedSource.NOMINAL and not name.startswith("mfpt/"):  # there the cage slips
        assert abs(result.line(line).deviation_pct) <= LARGEST_DEVIATION_PCT


def test_light_load_lets_the_cage_slip(recordings_dir):
    """The cage lags, most at the lightest load and least at the heaviest."""
    cage_pct = {}
    for number in (1, 3, 5, 7):
        result = analysed(recordings_dir, f"mfpt/InnerRaceFault_vload_{number}.mat")
        cage_pct[result.recording.radial_n] = cage_factor("BPFI", result.bearing) * result.line("BPFI").deviation_pct
    assert max(cage_pct.values()) < 0
    assert cage_pct[min(cage_pct)] == min(cage_pct.values())
    assert cage_pct[max(cage_pct)] == max(cage_pct.values())
