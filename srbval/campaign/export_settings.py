"""What a data set is to be made of."""

from __future__ import annotations

from dataclasses import dataclass

from srbval.campaign.noise import WHITE
from srbval.errors import ConfigurationError


@dataclass(frozen=True, kw_only=True)
class ExportSettings:
    """Segments of `segment_s` side by side, each without noise and with noise at every ratio of `snr_db`.

    `noise` is ``white`` or a recording whose spectrum it takes; `axis` that of the acceleration.
    """

    segment_s: float = 1.0
    snr_db: tuple[float, ...] = ()
    noise: str = WHITE
    axis: str = "y"
    seed: int = 0

    def __post_init__(self) -> None:
        if self.axis not in ("x", "y", "z"):
            raise ConfigurationError(f"axis {self.axis!r} must be x, y or z.")
        if self.noise != WHITE and not self.snr_db:
            raise ConfigurationError("a colour of noise is given, but no ratio: add --snr-db, such as --snr-db 10 0.")
