"""Which wavelet transform draws Figure 14, and how far each one is from what it should draw."""

from __future__ import annotations

import functools

from srbval.bench.scalogram_check import LARGEST_ERROR, TRANSFORMS, ScalogramCheck, check_scalogram
from srbval.report.table import Column, Table

# Rows that the transforms which do not draw the figure are tried at; the figure's own is tried at all of its rows.
_FEW_ROWS, _ONE_PLACE = 24, (0.4137,)
Window = tuple[int, float, tuple[float, float]]  # samples, their rate [Hz], rows from and to [Hz]


@functools.cache
def _checked(name: str, window: Window, whole: bool) -> ScalogramCheck:
    samples, fs_hz, range_hz = window
    if whole:
        return check_scalogram(name, samples=samples, fs_hz=fs_hz, range_hz=range_hz)
    return check_scalogram(
        name, samples=samples, fs_hz=fs_hz, range_hz=range_hz, rows=_FEW_ROWS, places=_ONE_PLACE
    )  # fmt: skip


def choose_transform(window: Window) -> ScalogramCheck:
    """The first that passes at every row, else the one with the smallest error; the table says which."""
    checks = []
    for name in TRANSFORMS:
        checks.append(_checked(name, window, True))
        if checks[-1].passed:
            return checks[-1]
    return min(checks, key=lambda c: max(c.tone_error, c.impulse_error))


def checks_table(window: Window) -> Table:
    """The errors of every transform in records like the figure's, measured while this report was made."""
    chosen = choose_transform(window)
    checks = [chosen if name == chosen.transform else _checked(name, window, False) for name in TRANSFORMS]
    return Table(
        id="scalogram-checks",
        label="What draws Figure 14",
        caption="Largest errors on records like the figure's, measured while this report was made: the reading of unit "
        "tones, and the picture of a unit impulse against the direct sum, as a share of its row's highest value. "
        f"Allowed: {100 * LARGEST_ERROR:g} %.",
        columns=(
            Column(title="Transform (complex Morlet)"),
            Column(title="Unit tones", unit="%", format=".2g"),
            Column(title="Impulse, worst row", unit="%", format=".2g"),
            Column(title="Impulse, median row", unit="%", format=".2g"),
            Column(title="Draws Figure 14"),
        ),
        rows=[
            [
                c.transform,
                100 * c.tone_error,
                100 * c.impulse_error,
                100 * c.median_impulse_error,
                "yes" if c is chosen else "passes" if c.passed else "no",
            ]
            for c in checks
        ],
        notes=(
            "PyWavelets picks the nearest of 2^precision stored points of an integrated wavelet and differences it: "
            "tones then read low by sin(x)/x, and impulses are drawn with steps. At its default precision of 10 these "
            "are as large as the picture in the lowest rows.",
        ),
    )
