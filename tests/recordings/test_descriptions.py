"""The descriptions of known data sets: complete, consistent with the bearings, found where they are."""

import re

import pytest

from srbval.bearing import known_bearings
from srbval.recordings.datasets.description import dataset, known_datasets
from srbval.storage.installation import shipped_folder

BAND_EDGE = 0.01  # upper band edges are stated as round numbers


def test_every_description_is_read_under_its_files_name() -> None:
    names = [path.stem for path in sorted(shipped_folder("data_manifest").glob("*.toml"))]
    assert [d.name for d in known_datasets()] == names
    assert {"cwru", "mfpt", "torino-excerpts", "torino-full", "hit-sm", "uestc", "ims", "upm-citef"} == set(names)


@pytest.mark.parametrize("description", known_datasets(), ids=lambda d: d.name)
def test_names_patterns_and_addresses_are_usable(description: object) -> None:
    d = dataset(description.name)  # type: ignore[attr-defined]
    assert {c.bearing for c in d.channels} - {None} <= set(known_bearings())
    for pattern in (d.match.file, *d.match.variables, *(c.variable for c in d.channels)):
        re.compile(pattern or "")
    assert d.url.startswith("https://")
    assert all(f.sha256 is None or re.fullmatch("[0-9a-f]{64}", f.sha256) for f in d.files)
    assert all(b.low_hz < b.high_hz and b.reason for b in d.bands)
    assert d.access in ("open", "restricted")


def test_open_sets_share_one_band_rule() -> None:
    """500 Hz to 10 kHz, or to 0.46 of a rate too low for it: nothing fitted to a set."""
    for description in known_datasets():
        for band in () if description.name.startswith("torino") else description.bands:
            fs_hz = band.fs_hz or description.rate.value_hz or 1e6
            assert band.low_hz == 500.0
            assert band.high_hz == pytest.approx(min(10000.0, 0.46 * fs_hz), rel=BAND_EDGE)
