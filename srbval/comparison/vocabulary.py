"""The words of every verdict on a comparison, and the two rules that choose among them.

A comparison has an error E, model minus rig, and its validation uncertainty U (ASME V&V 20, 2009). The model `differs`
from the rig if |E| > U. It `agrees` only if |E| + U is below a margin fixed beforehand: two one-sided tests (Schuirmann
1987), with U in place of 1.645 u so that they hold whatever the distribution of the inputs. Everything between the two
is `not resolved`.

A stated tolerance is `met` or `missed` by the chance that the error lies beyond it.
"""

import enum


class Verdict(enum.StrEnum):
    """Conclusion that a comparison error and its uncertainty allow."""

    AGREES = "agrees"
    DIFFERS = "differs"
    NOT_RESOLVED = "not resolved"
    INSUFFICIENT = "insufficient data"
    MET = "met"
    MISSED = "missed"


def verdict_on_error(error: float, uncertainty: float | None, margin: float | None = None) -> Verdict:
    """Verdict by E and U, both in the same unit as the `margin`; without U the data are insufficient."""
    if uncertainty is None:
        return Verdict.INSUFFICIENT
    if abs(error) > uncertainty:
        return Verdict.DIFFERS
    return Verdict.AGREES if margin is not None and abs(error) + uncertainty < margin else Verdict.NOT_RESOLVED


def verdict_on_tolerance(p_beyond: float, risk: float) -> Verdict:
    """Verdict by the chance that the error lies beyond the tolerance: missed from 1 - `risk` on, met up to `risk`."""
    if risk < p_beyond < 1 - risk:
        return Verdict.NOT_RESOLVED
    return Verdict.MET if p_beyond <= risk else Verdict.MISSED
