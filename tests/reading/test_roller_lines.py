"""Roller faults: twice the roller's turning and the cage's spacing beside it, read together, in a record that is known.

A pit's sidebands are weak and lie some tens of bins from a line many times as strong, whose side lobes pull at them.
"""

from __future__ import annotations

import math

import numpy as np

from srbval.bearing import Fault, load_bearing
from srbval.comparison.counterpart import SimulationCase, analyse_run
from srbval.models.simulate import simulate
from srbval.scene import paper_scene
from srbval.signal import Periodogram, read_comb

BEARING = load_bearing("skf-22240")
FS_HZ, SECONDS, SHAFT_HZ = 2000.0, 4.0, 710 / 60
LINE_HZ, CAGE_HZ = 2 * BEARING.orders.bsf * SHAFT_HZ, BEARING.orders.ftf * SHAFT_HZ
LINE_SNR, SIDE = 1200.0, 0.16
TRIALS = 40
LEAST_INSIDE = 0.83  # 40 trials of 95 %, four binomial standard errors


def made(rng: np.random.Generator) -> np.ndarray:
    """Two harmonics, each with sidebands of `SIDE` of its amplitude at the cage's speed, in noise."""
    time_s = np.arange(round(FS_HZ * SECONDS)) / FS_HZ
    gain = 1 + 2 * SIDE * np.cos(2 * np.pi * CAGE_HZ * time_s + rng.uniform(0, 6.28))
    line = sum(np.cos(2 * np.pi * h * LINE_HZ * time_s + rng.uniform(0, 6.28)) for h in (1, 2))
    return 3 + gain * line + np.sqrt(time_s.size / 4 / LINE_SNR) * rng.standard_normal(time_s.size)


def test_line_and_cage_spacing_of_a_made_record_lie_in_their_intervals() -> None:
    rng = np.random.default_rng(1)
    inside = []
    for _ in range(TRIALS):
        record = Periodogram.of(made(rng), FS_HZ, limit_hz=400.0, shaft_hz=SHAFT_HZ)
        found = read_comb(
            record, LINE_HZ, 0.8, harmonics=2, sideband_hz=CAGE_HZ * 1.0003, shortest_block_s=2 / SHAFT_HZ
        )
        assert found is not None
        assert found.sideband_hz is not None
        assert found.sideband_ci95_hz is not None
        line, spacing = abs(found.found_hz - LINE_HZ), abs(found.sideband_hz - CAGE_HZ)
        inside.append((line <= found.ci95_hz, spacing <= found.sideband_ci95_hz))
    assert np.all(np.mean(inside, axis=0) > LEAST_INSIDE)


def test_the_model_s_roller_and_cage_are_read_from_its_vibration() -> None:
    """Both are known from the run: the damaged roller's own turning, seen from its slot, and the cage's speed."""
    scene = paper_scene(
        duration_s=SECONDS, contact={"roller_fit": "printed"}, defect={"kind": "roller", "height": "-0.1 mm"},
        detail_rate_hz=1024.0,
    )  # fmt: skip
    run = simulate(scene)
    side = analyse_run(SimulationCase(id="r", purpose="test", state=Fault.ROLLER, scene=scene), run, BEARING)
    line, shaft_hz = side.analysis.line("2xBSF"), scene.shaft_hz
    assert side.line_order is not None
    assert line.detected
    assert abs(line.found_hz - side.line_order * shaft_hz) <= line.ci95_hz
    assert line.ci95_hz < 1e-3 * line.found_hz
    assert abs(line.sideband_hz - run.cage_ratio * shaft_hz) <= line.sideband_ci95_hz
    assert line.sideband_ci95_hz < 0.01 * line.sideband_hz
    assert all(side.analysis.line(name).detected for name in ("2xBSF-FTF", "2xBSF+FTF"))
    # Three contact circles of different radii: the roller turns faster than its middle circle alone would have it.
    assert 1.01 < side.line_order / (2 * BEARING.orders.bsf) < 1.03
    assert math.isclose(run.cage_ratio, BEARING.orders.ftf, rel_tol=0.005)
