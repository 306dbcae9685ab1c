"""A roller fault: twice the roller's turning and the cage's spacing beside it, read together, in a simulated record."""

import math

from srbval.bearing import Fault, load_bearing
from srbval.comparison.counterpart import SimulationCase, analyse_run
from srbval.models.simulate import simulate
from srbval.scene import paper_scene

BEARING = load_bearing("skf-22240")


def test_the_model_s_roller_and_cage_are_read_from_its_vibration() -> None:
    """Both are known from the run: the damaged roller's own turning, seen from its slot, and the cage's speed."""
    scene = paper_scene(
        duration_s=4.0,
        contact={"roller_fit": "printed"},
        defect={"kind": "roller", "height": "-0.1 mm"},
        detail_rate_hz=1024.0,
    )
    run = simulate(scene)
    side = analyse_run(SimulationCase(id="r", purpose="test", state=Fault.ROLLER, scene=scene), run, BEARING)
    line, shaft_hz = side.analysis.line("2xBSF"), scene.shaft_hz
    assert line.detected
    assert abs(line.found_hz - side.line_order * shaft_hz) <= line.ci95_hz
    assert line.ci95_hz < 1e-3 * line.found_hz
    assert abs(line.sideband_hz - run.cage_ratio * shaft_hz) <= line.sideband_ci95_hz
    assert line.sideband_ci95_hz < 0.01 * line.sideband_hz
    assert all(side.analysis.line(name).detected for name in ("2xBSF-FTF", "2xBSF+FTF"))
    # Three contact circles of different radii: the roller turns faster than its middle circle alone would have it.
    assert 1.01 < side.line_order / (2 * BEARING.orders.bsf) < 1.03
    assert math.isclose(run.cage_ratio, BEARING.orders.ftf, rel_tol=0.005)
