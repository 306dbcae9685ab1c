"""The closed sets of marks a report may carry: where a number comes from, and how it is judged.

Both are words first. Colour only repeats what the word and the sign already say.
"""

import enum


class Badge(enum.StrEnum):
    """Where a value or a picture comes from."""

    MEASURED = "measured"
    PUBLISHED = "published"
    STAND_IN = "stand-in"
    SIMULATED = "simulated"
    COMPUTED = "computed"
    ASSUMED = "assumed"


class Tone(enum.StrEnum):
    """How a value, a verdict or a callout is judged; `sign` is shown beside its text."""

    GOOD = "good"
    BAD = "bad"
    WARNING = "warning"
    NEUTRAL = "neutral"

    @property
    def sign(self) -> str:
        """One character that tells the tones apart without colour."""
        return {"good": "✓", "bad": "✗", "warning": "⚠", "neutral": "•"}[self.value]
