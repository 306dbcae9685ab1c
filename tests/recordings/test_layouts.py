"""Tables in any layout give the right rate, unit and samples, or an error that names the obstacle.

Combinations of header, lines above the header, separator, decimal sign, times, unit and missing samples are random.
"""

import datetime
import os
import re
from types import SimpleNamespace

import numpy as np
import pytest

from srbval.errors import DataError
from srbval.recordings import load_recording
from srbval.recordings.units import UNITS

from .formats import MEANT

DRAWN = 2000 if os.environ.get("SRBVAL_TESTS") == "all" else 150
VIBRATIONS = {"m/s2", "mm/s", "um", "V", "Pa"}  # units in which recordings are kept; latin-1 has no superscript minus
SPELLINGS = {text: unit for text, unit in MEANT.items() if UNITS.get(unit, "-")[0] in VIBRATIONS and "⁻" not in text}
TIME_NAMES = ("Time [{}]", "t ({})", "time/{}", "t_{}", "a.T/{}")  # the first ones with blanks
SCALES = {"s": (1.0, 7), "ms": (1e3, 5), "us": (1e6, 2), "ns": (1e9, 0)}  # per second, digits
EPOCHS = {"epoch_s": (10**9, 6), "epoch_ms": (10**6, 3), "epoch_us": (10**3, 0), "epoch_ns": (1, 0)}  # ns, digits
# What an example may be refused for: the commas of two kinds cannot be told apart.
OBSTACLES = re.compile(
    "decimal commas that cannot be distinguished|three digits after every comma|both decimal commas and points"
    "|if commas separate columns, decimals need a point"
)
START = datetime.datetime(2024, 5, 6, 23, 59, 59, 990_000, tzinfo=datetime.UTC)  # times run over midnight
STAMPS = {  # forms of the columns of times
    "iso": ["%Y-%m-%d %H:%M:%S.%f"],
    "iso T": ["%Y-%m-%dT%H:%M:%S.%fZ"],
    "hms": ["%H:%M:%S.%f"],
    "german": ["%d.%m.%Y %H:%M:%S.%f"],
    "american": ["%m/%d/%Y %I:%M:%S.%f %p"],
    "two columns": ["%Y-%m-%d", "%H:%M:%S.%f"],
}
VARIANTS = {
    "separator": (",", ";", "\t", "  "),
    "decimal": (".", ".", ".", ",", ","),
    "times": ("none", "counter", *SCALES, *EPOCHS, *STAMPS),
    "unit": tuple(SPELLINGS),
    "where_unit": ("[]", "()", "row", "above", "none"),
    "header": ("names", "names", "none", "comment"),
    "above": ("none", "key: value", "# key = value", "columns", "sep"),
    "fs_hz": (6000, 8000, 10_000, 12_000, 12_800, 16_000, 20_480, 25_600),
    "gaps": (True, False, False),
    "more": ("none", "none", "empty", "text", "nan", "temperature"),
    "ends": ("\n", "\r\n", "\n utf-8-sig", "\n utf-16", "\n latin-1"),
}


def stamps(layout, places):
    """Columns of times for the samples (none if the layout has no times), or of a counter that starts at 7."""
    t = places / layout.fs_hz
    if layout.times in SCALES:
        factor, digits = SCALES[layout.times]
        return [[f"{x * factor:.{digits}f}" for x in t]]
    if layout.times in EPOCHS:
        unit_ns, digits = EPOCHS[layout.times]
        at_ns = (places * 10**9) // layout.fs_hz + 1_714_996_800 * 10**9
        return [[f"{x / unit_ns:.{digits}f}" if digits else str(x // unit_ns) for x in at_ns]]
    if layout.times == "counter":
        return [[str(x) for x in 7 + places]]
    at = [START + datetime.timedelta(microseconds=round(x * 1e6)) for x in t]
    return [[x.strftime(form) for x in at] for form in STAMPS.get(layout.times, ())]


def written(layout, rng, samples):
    """Text of a table in the layout, and the indices of the samples that it contains."""
    places = np.arange(samples.size)
    if layout.gaps:
        starts = rng.integers(50, samples.size - 50, 3)
        places = np.setdiff1d(places, np.concatenate([np.arange(k, k + rng.integers(1, 9)) for k in starts]))
    mark, decimal = layout.separator, layout.decimal
    times = stamps(layout, places)
    quantity = {"two columns": ["Date", "Time"], "counter": ["sample"]}.get(layout.times, ["Time"] * len(times))
    if layout.times in SCALES:
        forms = TIME_NAMES[2:] if mark == "  " else TIME_NAMES
        quantity = [forms[int(rng.integers(len(forms)))].format(layout.times)]
    if layout.times in (*SCALES, "epoch_s", "epoch_ms"):
        times = [[x.replace(".", decimal) for x in times[0]]]
    name = {"[]": f"acc [{layout.unit}]", "()": f"acc ({layout.unit})"}.get(layout.where_unit, "acc")
    names, units = [*quantity, name], [*("" if q != "Time" else "-" for q in quantity), layout.unit]
    columns = [*times, [f"{x:.5f}".replace(".", decimal) for x in samples[places]]]
    extra = {"empty": ("", ""), "text": ("label", "OR007"), "nan": ("other", "NaN"), "temperature": ("temp [°C]", "45")}
    if layout.more in extra and mark != "  ":
        title, field = extra[layout.more]
        other = [field] * places.size
        if layout.more == "nan":
            other[5::7] = [f"1{decimal}5"] * len(other[5::7])
        columns, names, units = [*columns, other], [*names, title], [*units, ""]
    lines_above = {"sep": [f"sep={mark}"] * (mark != "  "), "columns": [f"Device{mark}DAQ-1", f"Channels{mark}2", ""]}
    head = lines_above.get(layout.above, [])
    if states_facts(layout):
        before, sign = ("# ", " =") if layout.above[0] == "#" else ("", ":")
        head = [f"{before}Device{sign} X-4711", f"{before}Sampling rate{sign} {layout.fs_hz} Hz"]
        head += [f"{before}Unit{sign} {layout.unit}"] if layout.where_unit == "above" else []
        head += [""]
    if layout.header != "none":
        head += [("# " if layout.header == "comment" else "") + mark.join(names)]
        head += [mark.join(units)] if unit_row(layout) else []
    end, _, encoding = layout.ends.partition(" ")
    lines = [*head, *(mark.join(row) for row in zip(*columns, strict=True)), ""]
    return end.join(lines).encode(encoding or "utf-8"), places


def states_facts(layout):
    return layout.above in ("key: value", "# key = value")


def unit_row(layout):
    return layout.where_unit == "row" and layout.header == "names" and layout.separator != "  "


def states_unit(layout):
    in_name = layout.where_unit in ("[]", "()") and layout.header != "none"
    return in_name or unit_row(layout) or (layout.where_unit == "above" and states_facts(layout))


@pytest.mark.timeout(300)
def test_any_layout(tmp_path):
    """Samples that are read are equal to those written; a table is refused only for a known obstacle."""
    assert sum(is_read_right(i, tmp_path / "table.csv") for i in range(DRAWN)) > 0.7 * DRAWN


def is_read_right(i, path):
    """True if the table is read with the right samples, False if it is refused for a known obstacle."""
    rng = np.random.default_rng((52, i))
    layout = SimpleNamespace(**{name: values[int(rng.integers(len(values)))] for name, values in VARIANTS.items()})
    samples = np.round(rng.normal(0, 1, 512), 5)
    content, places = written(layout, rng, samples)
    path.write_bytes(content)
    try:
        found = load_recording(path)
    except DataError as error:
        if not error.questions:
            if not OBSTACLES.search(str(error)):
                raise AssertionError(i, layout) from error
            return False
        found = load_recording(path, **answers(layout, error.questions))
    check(i, layout, found, samples, places)
    return True


def answers(layout, questions):
    """Settings for the questions that the file leaves open; no question may concern a stated fact."""
    asked = {question.missing.split(" (")[0] for question in questions}
    rate_known = states_facts(layout) or layout.times not in ("none", "counter")
    assert ("no sampling rate" in asked) <= (not rate_known or layout.header == "none"), (layout, asked)
    assert ("no unit" in asked) <= (not states_unit(layout)), (layout, asked)
    channel = [q for q in asked if q.startswith("which")]
    given: dict = {"fs_hz": float(layout.fs_hz)} if "no sampling rate" in asked else {}
    if "no unit" in asked:
        given["unit"] = SPELLINGS[layout.unit]
    assert not channel or layout.more == "nan", (layout, asked)
    return given | ({"channel": "acc"} if channel else {})


def check(i, layout, found, full, places):
    kept, factor = UNITS[SPELLINGS[layout.unit]]
    samples = found.channels[found.channel]
    assert found.fs_hz == pytest.approx(layout.fs_hz, rel=5e-4), (i, layout)
    assert found.unit == kept, (i, layout, found.unit)
    if layout.times != "none" and layout.gaps:
        assert samples.size == np.ptp(places) + 1, (i, layout)
        missing = f"{samples.size - places.size} of {samples.size} samples"
        assert any(missing in caution for caution in found.cautions), (i, layout)
        samples = samples[places - places[0]]
    np.testing.assert_allclose(samples, full[places] * factor, atol=1e-9)
