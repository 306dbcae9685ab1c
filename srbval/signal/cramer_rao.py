"""How well the frequency of a steady line can be told from noise at all."""

from __future__ import annotations

import math


def frequency_error_hz(information: float, seconds: float) -> float:
    """Least standard error of a tone's frequency, amplitude and phase unknown [Hz].

    It is ``sqrt(6 / information) / (2 pi T)``, Rife & Boorstyn 1974, IEEE Trans. Inf. Theory 20, 591. `information` is
    the tone's peak over its noise's mean power, both in a periodogram of the whole record; of several tones that move
    with the frequency, the sum of these, each times the square of how far it moves. Infinite where there is none.
    """
    return math.sqrt(6 / information) / (2 * math.pi * seconds) if information > 0 else math.inf
