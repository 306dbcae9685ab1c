"""How detection falls with added noise."""

import pytest

from srbval.studies.noise.study import noise_study

DECIBELS = (20.0, -45.0)  # a line that stands far above the noise, and one far below
LEAST_FALL = 5.0  # of a line's height over noise between the two ratios


@pytest.mark.slow
def test_detection_falls_with_noise() -> None:
    fractions: list[float | None] = []
    rows = noise_study(ratios_db=DECIBELS, seconds=1.0, draws=2, progress=lambda _, done: fractions.append(done))
    by_ratio = {(row["state"], row["snr_db"]): row for row in rows}
    assert len(by_ratio) == len(rows) == 6
    for state in ("outer", "inner"):
        clean, little, much = (by_ratio[state, ratio] for ratio in (None, *DECIBELS))
        assert [clean[name] for name in ("found", "draws", "deviation_pct")] == [1, 1, 0.0]
        assert little["found"] == little["draws"] == 2
        assert much["found"] == 0
        assert little["line_snr"] > LEAST_FALL * much["line_snr"]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
