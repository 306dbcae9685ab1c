"""The comparison of default runs with converged ones, short."""

from __future__ import annotations

from srbval.bearing import Fault
from tests.calibrators.rig_steps import compare


def test_a_default_run_is_close_to_the_converged_one() -> None:
    row = dict(compare(Fault.OUTER, 858.94, 0.05))
    assert row["status"] == "ok"
    assert row["1/step [Hz]"] >= 40960
    cage, _ = row["mean cage speed"].split(" ± ")
    assert 0 < abs(float(cage)) < 1e-5, "another number of slices and another step, so not the same"
    rms, _ = row["RMS in 500-1500 Hz"].split(" ± ")
    assert abs(float(rms)) < 0.1
