"""The study of bands: what it calls served, and its stored result."""

import pytest

from srbval.bearing import RACE_DEFECTS
from srbval.studies.rig_bands.study import BANDS, RIG, RIG_BAND_HZ, served

ROWS = [
    {"side": RIG, "state": state.value, "band_hz": list(band), "order": 8.2, "ci95": 3e-3, "detected": True}
    for state in RACE_DEFECTS for band in BANDS
]  # fmt: skip


@pytest.mark.parametrize(
    ("change", "expected"),
    [({}, True), ({"order": 8.204}, True), ({"order": 8.205}, False), ({"detected": False}, False),
     ({"order": None}, False)],
)  # fmt: skip
def test_a_band_serves_where_it_has_every_line_in_its_place(change: dict[str, object], expected: bool) -> None:
    last = ROWS[-1]
    assert tuple(last["band_hz"]) == RIG_BAND_HZ  # type: ignore[arg-type]
    assert served([*ROWS[:-1], last | change], RIG) is expected
