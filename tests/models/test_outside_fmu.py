"""FMUs made by `pythonfmu`: a run, its variables and units checked, its failures."""

import importlib
import re
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval import ConfigurationError, DataError, RunStatus, Scene, paper_scene, simulate
from srbval.storage.installation import shipped_folder

for library in ("fmpy", "pythonfmu"):
    pytest.importorskip(library)

SLAVE = """
import math, os
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real

class Bearing(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.shaft_speed, self.radial_load, self.defect = 1.0, 0.0, 0
        self.a_y, self.cage = 0.0, 0.0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(Real("shaft_speed", **fixed))
        self.register_variable(Real("radial_load", **fixed))
        self.register_variable(Integer("defect", **fixed))
        self.register_variable(Real("a_y", causality=Fmi2Causality.output))
        self.register_variable(Real("cage", causality=Fmi2Causality.output))

    def do_step(self, time, step):
        now = time + step
        self.cage = 0.43 * self.shaft_speed * now
        self.a_y = self.defect * self.radial_load * math.cos(3000 * now)
        if self.radial_load > 900:
            os._exit(9)
        return self.radial_load > 0
"""
TABLE = """
[scene]
shaft_speed_rad_s = { variable = "shaft_speed", unit = "rad/s" }
"load.radial_n" = { variable = "radial_load", unit = "kN" }
"defect.kind" = { variable = "defect", none = 0, outer = 2 }

[signals]
acceleration_m_s2 = { variable = "a_y", unit = "m/s2" }
cage_angle_rad = { variable = "cage", unit = "rad" }
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Build the FMU once; its description states the unit of the shaft's speed."""
    folder = tmp_path_factory.mktemp("fmu")
    (folder / "bearing.py").write_text(SLAVE, encoding="utf-8")
    builder = importlib.import_module("pythonfmu.builder").FmuBuilder
    plain = Path(builder.build_FMU(folder / "bearing.py", dest=folder))
    described = folder / "bearing.fmu"
    units = '<UnitDefinitions><Unit name="rad/s"/></UnitDefinitions>'
    with zipfile.ZipFile(plain) as source, zipfile.ZipFile(described, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                text = re.sub(r"(<LogCategories|<ModelVariables)", rf"{units}\1", content.decode(), count=1)
                content = re.sub(r'(name="shaft_speed".*?<Real)', r'\1 unit="rad/s"', text, flags=re.DOTALL).encode()
            target.writestr(name, content)
    return described


@pytest.fixture
def fmu(made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("bearing.fmu").write_bytes(made.read_bytes())
    Path("bearing.toml").write_text(TABLE, encoding="utf-8")
    return Path("bearing.fmu")


def scene(**changes: Any) -> Scene:
    known = {"model": "bearing.fmu", "duration": "0.05 s", "defect": {"kind": "outer"}, "solver": {"step_s": 1 / 40960}}
    return paper_scene(**known | changes)


@pytest.mark.usefixtures("fmu")
def test_an_fmu_is_given_the_scene_in_its_own_units():
    run = simulate(scene())
    assert run.status is RunStatus.OK, run.reason
    assert run.cage_ratio == pytest.approx(0.43)
    assert np.hypot(*run.acceleration_m_s2[:, :2].T).max() == pytest.approx(2 * 124.8, rel=0.01)
    assert np.isnan(run.displacement_m).all()


@pytest.mark.usefixtures("fmu")
@pytest.mark.parametrize(
    ("load", "status", "reason"),
    [("1 MN", RunStatus.DIED, "exit code 9"), ("0 N", RunStatus.RAISED, "the FMU stopped at 0 of")],
)
def test_an_fmu_that_fails_is_a_status(load, status, reason):
    run = simulate(scene(load={"radial": load}))
    assert (run.status, reason in run.reason) == (status, True), run.reason


@pytest.mark.usefixtures("fmu")
@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ('"a_y"', '"a_z"', "acceleration_m_s2: the FMU has no variable 'a_z'; did you mean 'a_y'"),
        ('unit = "rad/s"', 'unit = "rpm"', "the unit 'rpm' differs from the FMU's 'rad/s'"),
        ('unit = "kN"', 'unit = "bar"', "'radial_load' has the unit 'bar'. Known units: N, kN, MN"),
        (', unit = "m/s2"', "", "'a_y' has no unit in the FMU's description; state it here"),
        ("shaft_speed_rad_s", "shaft_speed", "'shaft_speed' is not known; did you mean 'shaft_speed_rad_s'"),
        ("acceleration_m_s2", "ring_displacement_m", "has the unit 'm/s2'"),
    ],
)
def test_a_wrong_table_is_an_error_with_its_remedy(old, new, text):
    Path("bearing.toml").write_text(TABLE.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigurationError) as caught:
        simulate(scene())
    assert text in str(caught.value)


RECORD = shipped_folder("data_manifest") / "rig_excerpts" / "OR_877rpm_sample.h5"
COMMANDS = {"bench": ("--quick",), "validate": ("--measured", RECORD, "--no-pdf")}


@pytest.mark.usefixtures("fmu", "_results_of_the_module")
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("old", "new", "codes", "text"),
    [
        ("", "", (0, 0), r"bearing\.fmu own +61440 .* ok|cage ratio +1 +0\.4304 +0\.43 "),
        ('"kN"', '"N"', (0, 4), r"its process ended \(exit code 9\)"),
        ('"kN"', '"bar"', (2, 2), "'radial_load' has the unit 'bar'. Known units: N, kN, MN"),
    ],
)
def test_an_fmu_on_the_bench_and_in_a_validation(old, new, codes, text, command, srbval_text, monkeypatch):
    """In newtons the load is beyond what the FMU survives."""
    monkeypatch.setattr("srbval.studies.bench.QUICK", ((61440,), 0.01, 0.1))
    Path("bearing.toml").write_text(TABLE.replace(old, new), encoding="utf-8")
    code = codes[command == "validate"]
    assert re.search(text, "".join(srbval_text(command, "--model", "bearing.fmu", *COMMANDS[command], code=code)))


def test_a_file_that_is_no_fmu(fmu):
    fmu.write_bytes(b"PK nothing")
    with pytest.raises(DataError, match=r"bearing\.fmu: cannot read this FMU"):
        simulate(scene())
