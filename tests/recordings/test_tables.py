"""Tables and their times: an irregularity is an error, a question or a caution; nothing is guessed."""

import codecs

import numpy as np
import pytest
from scipy.io import savemat

from srbval.errors import DataError
from srbval.recordings import load_recording
from srbval.recordings.loaders import text as text_loader
from srbval.recordings.loaders.text import load_text
from srbval.recordings.manifest import FileStatus
from srbval.recordings.registry import add

from . import files

ROWS = 400
X, Y = files.vibration(ROWS).round(4), files.vibration(ROWS, 1).round(4)
TABLE = [f"{a:.4f},{b:.4f}" for a, b in zip(X, Y, strict=True)]
SEMICOLONS = [f"{a:.4f};{b:.4f}".replace(".", ",") for a, b in zip(X, Y, strict=True)]


def read(tmp_path, lines):
    path = tmp_path / "table.csv"
    if not isinstance(lines, bytes):
        lines = (lines if isinstance(lines, str) else "\n".join(lines) + "\n").encode()
    path.write_bytes(lines)
    found = load_text(path)
    for name in found.unusable:  # which the others do not need
        found.check_usable(name)
    return dict(found.variables)


def changed(at, *lines):
    return [*TABLE[:at], *lines, *TABLE[at + 1 :]]


REFUSED = [
    (changed(9, "", "", "0,0"), r"2 line\(s\) among the samples are blank, contain a # .* first is line 10\."),
    (["a,b", *(row + ",0.5" for row in TABLE)], "line 1 has 2 names for 3 columns"),
    (["a,,c", *(row + ",0.5" for row in TABLE)], "line 1 is not a row of numbers, and '' is not a column name"),
    (changed(0, "0.12x, 0.3"), "line 1 is not a row of numbers, and '0.12x' is not a column name"),
    (["a,a", *TABLE], "line 1 names more than one column 'a'"),
    (changed(7, "0.1"), r"1 line\(s\) .* do not have 2 fields as line 1 has, the first is line 8\."),
    (changed(0, "0.1"), r"1 line\(s\) of numbers above the table do not fit its columns, the first is line 1\."),
    (changed(7, "0.1,0.2,0.3", "0.1,0.2,", "0.3"), r"2 line\(s\) .* do not have 2 fields .* first is line 8\."),
    (changed(5, "NaN,0.1", "0.1,inf"), r"1 line\(s\) with a field that is not finite \('NaN'\) in col_1, .* line 6\."),
    (changed(5, "0.1,0.2 V"), r"not finite \('0\.2 V'\) in col_2.* line 6\."),
    (changed(5, "0.1,0.2 # later"), r"1 line\(s\) .* contain a # .* first is line 6\."),
    (changed(5, "#0.1,0.2", "# remark"), r"1 line\(s\) .* contain a # .* first is line 6\."),
    (changed(5, "0.1,0.2\r3"), r"1 line\(s\) with control characters, the first is line 6"),
    ([*(TABLE * 3)[:999], "0.1,0.2\x003", *TABLE], r"1 line\(s\) with control characters, the first is line 1000\."),
    (["# fs = 1000", "# fs = 2000", *TABLE], r"states fs = 1000\.0 and 2000\.0"),
    (codecs.BOM_UTF16_LE + "\n".join(TABLE).encode("utf-16-le")[:-1], "damaged UTF-16 text"),
]
COMMAS = [
    ([row.replace(".", ",") for row in TABLE], "line .* has decimal commas that cannot be distinguished from"),
    ([f"{a:.1f}".replace(".", ",") for a in X], "line .*-0,.* has decimal commas that cannot be distinguished"),
    (["x", *(f"{a:.4f}".replace(".", ",") for a in X)], "1 names for 2 columns. .*decimals need a point"),
    (["x", *SEMICOLONS], r"1 names for 2 columns\. Give each column a name\.$"),
    (["12,34", "5,6", "7,08", *["1,1"] * 300], "line 3, '7,08', has decimal commas"),
    ([*SEMICOLONS, "1.234,56;0,1"], "is in a table of both decimal commas and points, or with thousands separators"),
    ([f"{i % 7 + 1},{i:03d};{i % 5 + 1},{i:03d}" for i in range(100, 500)], "three digits after every comma"),
    ([*SEMICOLONS, "1,234,567;0,1"], r"not finite \('1,234,567'\)"),
]


@pytest.fixture(params=[text_loader.END_BYTES, 300])
def ends(request, monkeypatch):
    """Every line is examined, or only those of 300 bytes at both ends, as of a long text."""
    monkeypatch.setattr(text_loader, "END_BYTES", request.param)


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    "lines",
    [
        TABLE,
        ["# fs_hz = 1000", "a [g],b [g]", *TABLE, "# end"],
        ["a;b", *SEMICOLONS],
        ["time\ta", *(f"{i / 1000}\t{a:.3e}" for i, a in enumerate(X))],
        [f"  {a:+}   {i}" for i, a in enumerate(X)],
        [f"{a}, {b} ," for a, b in zip(X, Y, strict=True)],
        [f"{a}" for a in X],
    ],
)
def test_a_long_table_of_plain_numbers_is_converted_in_blocks(tmp_path, monkeypatch, lines, end):
    expected = read(tmp_path, end.join([*lines, ""]))
    whole = load_text(tmp_path / "table.csv")
    for name, value in {"END_BYTES": 300, "BLOCK_BYTES": 1000, "LARGEST_TEXT": 1000}.items():
        monkeypatch.setattr(text_loader, name, value)
    if lines[-1].endswith(","):  # an empty field at the end of each line: each line is examined
        with pytest.raises(DataError, match="no regular table of plain numbers"):
            load_text(tmp_path / "table.csv")
        return
    found = load_text(tmp_path / "table.csv")
    np.testing.assert_array_equal(list(found.variables.values()), list(expected.values()))
    assert vars(found) | {"variables": {}} == vars(whole) | {"variables": {}}


@pytest.mark.usefixtures("ends")
@pytest.mark.parametrize(("lines", "said"), REFUSED + COMMAS)
def test_what_is_refused(tmp_path, lines, said):
    with pytest.raises(DataError, match=said):
        read(tmp_path, lines)
    (entry,) = add(tmp_path).recordings
    damaged = entry.status is FileStatus.UNREADABLE  # a damaged table is a damaged recording, a readme is none
    assert damaged or any("not finite" in note for note in load_text(tmp_path / "table.csv").unusable.values())


@pytest.mark.usefixtures("ends")
@pytest.mark.parametrize(
    "lines",
    [
        ["", "", "a,b", "", *TABLE, "", " "],
        ["a,b,", *(row + "," for row in TABLE)],
        ["a,b", *(row + "," for row in TABLE)],
        ['"a","b"', *('"' + row.replace(",", '","') + '"' for row in TABLE)],
        ["a, b", *(row.replace(",", " , ") for row in TABLE)],
        ["a\tb", TABLE[0].replace(",", "\t"), "# a remark of one's own, in between", "#"]
        + [row.replace(",", "\t") for row in TABLE[1:]],
    ],
)
def test_what_is_harmless(tmp_path, lines):
    found = read(tmp_path, lines)
    assert list(found) == ["a", "b"]
    np.testing.assert_array_equal([found["a"], found["b"]], [X, Y])


def test_line_ends_of_old(tmp_path):
    np.testing.assert_array_equal(list(read(tmp_path, "\r".join(["a,b", *TABLE])).values()), [X, Y])
    assert load_text(tmp_path / "table.csv").notes == ("the last line has no end: the file may have been cut there",)


N = 4096
GRID = np.arange(N) / 20480
JITTER = np.random.default_rng(0).uniform(-0.02, 0.02, N) / 20480
SAMPLE = np.arange(N)


def load(tmp_path, values, **given):
    savemat(tmp_path / "a.mat", {"x": files.vibration(N)} | values, oned_as="column")
    return load_recording(tmp_path / "a.mat", unit="g", **given)


def text(tmp_path, name, times):
    rows = (f"{t},{x:.6f}" for t, x in zip(times, files.vibration(len(times)), strict=True))
    (tmp_path / "a.csv").write_text("\n".join([f"{name},x", *rows, ""]))
    return load_recording(tmp_path / "a.csv", unit="g")


ROUNDED = [(".5f", 20_480.0), (".6f", 25_600.0), (".7f", 20_480.0), (".9f", 10_000.0), (".7g", 20_480.0)]


@pytest.mark.parametrize(("digits", "fs_hz"), [*ROUNDED, (".6e", 25_600.0), (".8g", 102_400.0)])
def test_rounded_times_are_even(tmp_path, digits, fs_hz):
    recording = text(tmp_path, "t", [f"{i / fs_hz:{digits}}" for i in range(N)])
    assert recording.fs_hz == pytest.approx(fs_hz, rel=1e-4)
    assert recording.cautions == ()


@pytest.mark.parametrize(
    ("values", "said"),
    [
        # times without a unit that mean no vibration record
        ({"t": SAMPLE / 10}, r"\(t has a step of 0.1, 10 Hz if in s, 10000 Hz if in ms, .*: --fs HZ"),
        ({"t": GRID * 1e6}, r"a step of 48\.8281, 0\.02048 Hz if in s, 20\.48 Hz if .*, 20480 Hz if in us\): --fs HZ"),
        ({"t": GRID / 1e6}, r"2\.048e\+10 Hz if in s"),
        ({"t": SAMPLE, "fs": "1.2.3"}, r"\(t counts the samples"),  # a rate that is no number
        ({"t": SAMPLE + 1.0}, r"\(t counts the samples"),
        # names that contradict each other, and rates in another unit
        ({"fs": 8000.0, "sr": 9000.0}, r"\(fs = 8000 and sr = 9000 contradict each other\): --fs HZ"),
        ({"fs": 8000.0, "sr": 9000.0, "t": GRID + JITTER}, "fs = 8000 and sr = 9000 contradict each other"),
        ({"t": GRID.round(3)}, r"too coarse for a rate: \d+ of 4095 steps are zero; on average 20475 Hz\): --fs HZ"),
        ({"fs": -1.0}, r"\(fs = -1 is not within 500 to 5e\+06, perhaps in another unit\)"),
        ({"fs": 20.48}, r"\(fs = 20\.48 is not within 500 to 5e\+06, perhaps in another unit\)"),
        ({"fs": 8e3, "rpm": 1200.0, "mean_rpm": 1500.0}, "rpm = 1200 and mean_rpm = 1500 contradict each other. State"),
    ],
)
def test_rate_or_speed_stays_open(tmp_path, values, said):
    with pytest.raises(DataError, match=f"information: (no (sampling rate|even times) .*)?{said}"):
        load(tmp_path, values)


@pytest.mark.parametrize(
    ("times", "said"),
    [
        (GRID + JITTER, r"\d{4} of 4095 steps, the worst off by 3\.\d+ %"),
        (GRID + 5e3 / 20480 * (SAMPLE >= 1000), r"1 of 4095 steps, .* off by 5e\+05 %"),  # more than half is missing
        (GRID - 1 / 20480 * (SAMPLE >= 10), r"1 of 4095 steps, the worst off by 100 %"),
        (GRID - 5 / 20480 * (SAMPLE >= 2000), r"1 of 4095 steps, the worst off by 500 %"),
        (GRID + 0.01 * GRID**2, r"2042 of 4095 steps, the worst off by 0\.2 %"),
    ],
)
def test_uneven_times_leave_the_rate_open(tmp_path, times, said):
    """With an absolute tolerance of 1 us, jitter of 2 % at 20 kHz would count as even."""
    remedy = "export them again, rising" if np.diff(times).min() < 0 else "--resample HZ"
    with pytest.raises(DataError, match=rf"no even times \(the times of t.*{said}\): {remedy}") as refused:
        load(tmp_path, {"t": times})
    assert "--fs" not in str(refused.value)
    (caution,) = load(tmp_path, {"t": times}, fs_hz=20_480.0).cautions
    assert caution.endswith("read as even, at 20480 Hz")
    assert load(tmp_path, {"t": times, "fs": 20_480.0}).cautions == (caution,)


NOT_FINITE = "1 of the times of t are not finite numbers; read as even, at 20480 Hz"


@pytest.mark.parametrize(
    ("times", "fs_hz", "cautions"),
    [
        (GRID, 25_600.0, ("the times of t mean 20480 Hz, read at 25600 Hz",)),
        (GRID, 20_480.0, ()),
        ((100 + GRID).astype(np.float32), 20_480.0, ()),  # the digits of single precision are even
        (GRID * 1e3, 20_480.0, ()),
        (GRID * 1e3, 30_000.0, ("the times of t mean 20.48 Hz, read at 30000 Hz",)),
        (SAMPLE, 30_000.0, ()),
        (np.where(SAMPLE == 7, np.nan, GRID), 20_480.0, (NOT_FINITE,)),
    ],
)
def test_a_rate_against_the_times(tmp_path, times, fs_hz, cautions):
    """The rate is stated by the file or by the user."""
    assert load(tmp_path, {"t": times, "fs": fs_hz}).cautions == cautions
    assert load(tmp_path, {"t": times}, fs_hz=fs_hz).cautions == cautions


def test_what_is_left_out_is_said(tmp_path):
    notes = load(tmp_path, {"fs": 8000.0, "short": np.arange(100.0), "no": np.arange(1, N + 1)}).notes
    assert "left out, no signal of 256 samples or more: short (100, 1), no (4096, 1)" in notes
    notes = load(tmp_path, {"fs": 8000.0, "y": files.vibration(300)}, channel="x").notes
    assert "left out, of another length, rate or unit: y" in notes
    (entry,) = add(tmp_path).recordings
    assert entry.channels == ("x", "y")


def cautions_of(tmp_path, samples):
    np.save(tmp_path / "x.npy", samples)
    return load_recording(tmp_path / "x.npy", fs_hz=8000.0, unit="unknown").cautions


def clipped(top=1.5):
    return np.clip(files.vibration(40_000), -9, top)


@pytest.mark.parametrize("scale", [1.0, 9.80665 / 2**15, 1e-3])
def test_limits_of_a_converter_are_clipping(tmp_path, scale):
    samples = np.clip(np.round(files.vibration(20_000) * 2**15 / 1.5), -(2**15), 2**15 - 1)
    for extreme, said in zip((samples.max(), samples.min()), cautions_of(tmp_path, samples * scale), strict=True):
        count = int((samples == extreme).sum())
        assert f"clipped: {count} of 20000 samples ({count / 200:.2g} %) at {extreme * scale:.6g}, up to " in said


def test_held_samples_and_zeros(tmp_path):
    samples = files.vibration(40_000)
    samples[1000:1020], samples[5000:5100] = samples[1000], 0.0
    held = "repeated instead of measured: 120 of 40000 samples (0.3 %) in 2 runs"
    assert cautions_of(tmp_path, samples) == (f"{held}, the longest 100 times 0 from sample 5000 on",)


@pytest.mark.parametrize(
    "samples",
    [
        files.vibration(40_000),
        np.round(files.vibration(200_000) * 0.5),  # into 5: repeats of a dozen samples are chance
        np.round(500 * np.sin(np.arange(40_000) / 700)),  # a slow sine's tops are flat by their digits alone
        np.repeat(files.vibration(10_000), 4),  # held evenly throughout: no single run says anything
        np.sin(2 * np.pi * np.arange(40_000) / 40),  # its peaks are exactly 1, a thousand times
        np.where(np.arange(4096) == 5, 1.0, 0.0) + files.vibration(),
    ],
)
def test_sound_samples_are_not_accused(tmp_path, samples):
    assert cautions_of(tmp_path, samples) == ()


def test_analyse_and_data_show_the_cautions_of_the_channel_analysed(tmp_path, srbval_text, srbval_json):
    path = tmp_path / "a.mat"
    savemat(path, {"good": files.vibration(40_000), "x": clipped(), "fs": 8000.0})
    assert load_recording(path, channel="good", unit="g").cautions == ()
    options = ["--channel", "x", "--unit", "g", "--rpm", "1500", "--bearing", "skf-6205"]
    out = srbval_text("analyse", path, "--band", "500", "3000", *options).out
    assert out.index("caution: clipped: ") < out.index("all lines, features, reasons")
    (said,) = srbval_json("analyse", path, "--band", "500", "3000", *options)["cautions"]
    assert f"a.mat: caution: {said}" in srbval_text("data", "add", path, *options).out
    (entry,) = srbval_json("data", "list")["recordings"]
    assert (entry["cautions"], entry["status"], entry["reason"]) == ([said], "ok", None)


def test_a_cautioned_healthy_baseline_is_said(tmp_path, srbval_text):
    """The verdict depends on the baseline, so its caution is reported."""
    acceleration = files.vibration(40_000)
    common = {"time_acc": np.arange(40_000) / files.FS_HZ, "rpm_nominal": 353, "mean_rpm": 353.0}
    common |= {"rpm": 353 + 0.5 * files.vibration(1250, 1), "time_rpm": np.arange(1250) / 640}
    for state, samples in (("OR", acceleration), ("H", np.clip(acceleration, -9, 1.5))):
        files.excerpt(tmp_path / f"{state}_353rpm_x.mat", condition=state, acc_m_s2=samples, acc_g=samples, **common)
    add(tmp_path)
    shown = srbval_text("analyse", tmp_path / "OR_353rpm_x.mat")
    assert "caution: healthy baseline" in shown.err
    assert "H_353rpm_x.mat: clipped: " in shown.err
    assert "caution: " not in shown.out
