"""Drive power in oil beside SKF's moment of a spherical roller bearing, over speed and load.

SKF's model (Rolling bearings: the formulas of table 2a were read; the constants of series 222 are quoted from memory),
without drag and starvation. It is no model of this bearing's races, hence the wide tolerance; what must agree is the
size, and the growth with speed and load.
"""

import math

import pytest

from srbval.models.run import works
from srbval.models.simulate import Step, simulate
from srbval.scene import load_scene

MEAN_MM = (200.0 + 360.0) / 2  # of bore and outside diameter
R1, R3, S1, S3 = 1.6e-6, 2.81e-6, 3.62e-3, 8.8e-3  # radial load alone
TURNS = 1.5  # of the shaft, recorded, and as many before them
WITHIN = 0.35  # of SKF's power: the model is 15 % below it at 340 rpm and 29 % above at a quarter of the load


def skf_power_w(rpm: float, radial_n: float) -> float:
    """Rolling and sliding power."""
    oil = load_scene("rig-oil").oil
    assert oil is not None
    viscosity = oil.kinematic_mm2_s()
    flow = viscosity * rpm
    rolling = min(R1 * MEAN_MM**1.85 * radial_n**0.54, R3 * MEAN_MM**2.3 * radial_n**0.31)
    sliding = min(S1 * MEAN_MM**0.25 * radial_n ** (4 / 3), S3 * MEAN_MM**0.94 * radial_n)
    heated = 1 / (1 + 1.84e-9 * (rpm * MEAN_MM) ** 1.28 * viscosity**0.64)
    boundary = math.exp(-2.6e-8 * flow**1.4 * MEAN_MM)
    moment_nmm = heated * rolling * flow**0.6 + sliding * (0.15 * boundary + 0.05 * (1 - boundary))
    return moment_nmm * 1e-3 * rpm * math.pi / 30


@pytest.mark.parametrize(
    ("rpm", "radial_kn"),
    [
        (859.0, 124.8),
        (859.0, 31.2),
        *(
            pytest.param(rpm, load, marks=pytest.mark.long_form)
            for rpm, load in ((127.0, 124.8), (340.0, 124.8), (600.0, 124.8), (1000.0, 124.8), (859.0, 62.4))
        ),
    ],
)
def test_drive_power_is_near_skfs(rpm, radial_kn):
    turns = dict.fromkeys(("duration_s", "settle_s"), TURNS * 60 / rpm)
    own = {"shaft_speed": f"{rpm} rpm", "load": {"radial": f"{radial_kn} kN"}} | turns
    run = simulate(load_scene("rig-oil", own), step=Step.UNCHECKED)
    assert works(run.status), run.reason
    assert run.drive_power_w == pytest.approx(skf_power_w(rpm, 1e3 * radial_kn), rel=WITHIN)
