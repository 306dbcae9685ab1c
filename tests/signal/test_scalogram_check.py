import dataclasses
import functools

import numpy as np
import pytest

from srbval.signal import scalogram_check
from srbval.signal.scalogram_check import TRANSFORMS, check_scalogram

WINDOW = {"samples": 4097, "fs_hz": 20_480.0, "range_hz": (40.0, 1000.0)}  # Figure 14's
FEW = {"rows": 8, "places": (0.4137,)}


def test_the_closed_form_passes_at_every_row_of_the_figure():
    check = check_scalogram("closed-form Morlet", **WINDOW)
    assert check.passed
    assert check.impulse_error < 1e-3
    assert check.tone_error < 1e-3


def test_pywt_as_it_comes_does_not():
    """The mistake of drawing impulses with an integer-indexed wavelet: the lowest rows are wrong by their own size."""
    check = check_scalogram("pywt.cwt as it comes", **WINDOW, **FEW)
    assert not check.passed
    assert check.impulse_error > 0.14
    assert check.tone_error > 0.005


@pytest.mark.parametrize("kind", ["late", "low", "stepped"])
def test_a_planted_error_is_caught(kind, monkeypatch):
    monkeypatch.setitem(TRANSFORMS, kind, functools.partial(planted, kind=kind))
    assert not check_scalogram(kind, **WINDOW).passed


def planted(samples, fs_hz, *, kind, **options):
    picture = scalogram_check.morlet_scalogram(samples, fs_hz, **options)
    image = {
        "late": lambda a: np.roll(a, 1, axis=1),
        "low": lambda a: 0.99 * a,
        "stepped": lambda a: np.repeat(a[:, ::2], 2, axis=1)[:, : a.shape[1]],
    }[kind](picture.amplitude)
    return dataclasses.replace(picture, amplitude=image)
