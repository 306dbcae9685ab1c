"""The card that goes with a data set: how it was made, what it is not good for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from srbval import __version__
from srbval.campaign.export_settings import ExportSettings
from srbval.campaign.noise import Colour

CARD = """\
# {name}: labelled segments of simulated bearing vibration

**Every sample is simulated.** Nothing here was measured; {noise_origin}

## How it was made
- srbval {program}, campaign "{name}" ({title}), model version {version}; {cases} cases.
- Acceleration of the outer ring along {axis}, m/s2, {fs_hz:g} Hz, cut into {segments} segments of {segment_s:g} s that
  do not overlap. float32.
- Noise: {noise}
- Labels: `state` (0 healthy, 1 outer race, 2 inner race, 3 roller), `shaft_speed_hz`, `radial_n`, `axial_n`,
  `defect_height_m`, `defect_extent_m`, `snr_db`, `case`, `start_s`.

## What it is not good for
- **Claims about measured machines.** Amplitudes were not matched with any; there is no transfer path, no sensor, no
  lubrication, no neighbouring machine. Test on measured records before you say that something works.
- **Random splits.** Segments of one case, and its noisy copies, are the same run: split by `case`, better by speed or
  load, or the test set leaks into the training set.
- **Severity.** Defects are bumps or pits of ideal shape, not the grown damage of a real bearing.
- **High frequencies.** The raceways are points; their passing excites lines of its own above about 1.4 kHz.
"""


def data_card(
    about: Mapping[str, Any], settings: ExportSettings, colour: Colour, *, cases: int, segments: int, fs_hz: float
) -> str:
    """The card as Markdown."""
    ratios = ", ".join(f"{ratio:g}" for ratio in settings.snr_db)
    coloured = colour.frequency_hz is not None
    noise = (
        f"each segment comes without noise (`snr_db` infinite) and with {colour.name if not coloured else 'coloured'} "
        f"Gaussian noise at {ratios} dB, seed {settings.seed}. The ratio is that of the variances of the whole "
        "segment, over all frequencies."
        if ratios
        else "none was added; `snr_db` is infinite throughout."
    )
    return CARD.format(
        name=about["name"],
        title=about["title"] or "no title",
        version=about["version"],
        program=__version__,
        cases=cases,
        axis=settings.axis,
        fs_hz=fs_hz,
        segments=segments,
        segment_s=settings.segment_s,
        noise=noise,
        noise_origin=(
            f"only the spectrum of the added noise was taken from {colour.name}."
            if coloured
            else "the noise, where there is any, is made too."
        ),
    )
