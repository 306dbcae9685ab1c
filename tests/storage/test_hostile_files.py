"""TOML files that are no good: refused at once with one printable line, whoever asks for them."""

import math
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from srbval.bearing import load_bearing
from srbval.campaign.cases import plan_cases
from srbval.campaign.settings import load_campaign
from srbval.errors import ConfigurationError, DataError, SrbvalError
from srbval.models.run import RunStatus
from srbval.models.simulate import simulate, simulate_to_file
from srbval.scene import SpeedProfile, load_scene, paper_scene
from srbval.storage.tables import parse_quantity

LONGEST = SrbvalError.longest + 20
READERS: list[Callable[[str], object]] = [load_scene, load_bearing, load_campaign]
TEXTS = {
    "5,000 digits": "seed = " + "9" * 5000,
    "1e400": 'duration_s = 1e400\n[load]\nradial = "1e400 kN"',
    "nested lists": "seed = " + "[" * 20_000 + "]" * 20_000,
    "dotted key": ".".join("a" * 20_000) + " = 1",
    "long key": "a" * 1_000_000 + " = 1",
    "control characters": '"\\u0000\\u001b[2J\\n\\u202e" = 1',
    "long value": f'bearing = 5\nmodel = "{"x" * 1_000_000}"',
    "long number": f'duration = "{"1" * 1_000_000}\\nx"',
    "date": "seed = 1979-05-27",
    "NUL": "seed = \0",
    "not UTF-8": b"bearing = '\xff'",
    "surrogate": 'bearing = "\\ud800"',
    "2 MB": "# " + "x" * 2**21,
}


def refused(act: Callable[[], object]) -> str:
    with pytest.raises((ConfigurationError, DataError)) as caught:
        act()
    text = str(caught.value)
    assert text.isprintable()
    assert len(text) < LONGEST
    return text


@pytest.mark.timeout(20)
@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.__name__)
@pytest.mark.parametrize("what", TEXTS)
def test_hostile_texts(what: str, reader: Callable[[str], object], tmp_path: Path) -> None:
    path, text = tmp_path / "file.toml", TEXTS[what]
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    assert "file.toml" in refused(lambda: reader(str(path)))


@pytest.mark.timeout(20)
@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.__name__)
def test_what_is_no_file(reader: Callable[[str], object], tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    (tmp_path / "loop.toml").symlink_to("loop.toml")
    with (tmp_path / "huge.toml").open("wb") as file:
        file.truncate(2**30)
    for name in ("pipe", "folder", "zero", "loop", "huge", "a\0b", "a\ud800b", "a\udcffb", "x" * 5000):
        refused(lambda name=name: reader(f"{tmp_path}/{name}.toml"))
    campaign = tmp_path / "campaign.toml"
    campaign.write_text('name = "a"\nscene_file = "pipe.toml"')
    assert "pipe.toml" in refused(lambda: load_campaign(str(campaign)))
    refused(lambda: paper_scene(bearing=f"{tmp_path}/pipe.toml") and load_bearing(f"{tmp_path}/pipe.toml"))


VALUES = [10**400, -(10**400), 10**5000, "1e400 kN", "9" * 5000, math.inf, math.nan, [[]], {}, "5", "5 lbf", "kN",
          "1e999 N", "nan N", True, None, [1]]  # fmt: skip


@pytest.mark.parametrize("value", VALUES, ids=range(len(VALUES)))
def test_hostile_quantities(value: object) -> None:
    assert refused(lambda: parse_quantity(value, "force", "here")).startswith("here")


LIMITS = {
    "--seconds 1e12": ({"duration_s": 1e12}, "1e\\+12"),
    "output rate": ({"output_rate_hz": 1e15}, "1e\\+15.*1e\\+06"),
    "step": ({"solver": {"step_s": 1e-30}}, "steps per output"),
    "points": ({"contact": {"points_per_circle": 10**9}}, "1000000000.*100000"),
    "defects": ({"further_defects": [{"kind": "outer"}] * 10**6}, "100000[01].*20"),
    "stiff": ({"contact": {"stiffness_n_m": 1e300}}, "1e\\+300"),
    "seed": ({"seed": -1}, "seed = -1"),
    "angle": ({"load": {"direction_rad": 1e300}}, "1e\\+300"),
}


@pytest.mark.timeout(20)
@pytest.mark.parametrize("what", LIMITS)
def test_values_that_no_machine_has(what: str) -> None:
    changes, message = LIMITS[what]
    with pytest.raises(ConfigurationError, match=message):
        paper_scene(**changes)


def test_what_fits_nowhere_is_refused_before_it_starts(tmp_path: Path) -> None:
    """Days of signals in memory or on the disk; an hour may be streamed."""
    days = paper_scene(duration_s=5e5)
    with pytest.raises(ConfigurationError, match=r"GB of memory, there are .* GB.*use -o"):
        simulate(days)
    with pytest.raises(ConfigurationError, match=r"GB of (disk|memory)"):
        simulate_to_file(days, tmp_path / "run.h5")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(ConfigurationError, match="passages"):
        simulate(paper_scene(model="impulse", duration_s=1e4, output_rate_hz=100.0, shaft_speed_rad_s=5e4, settle_s=0.0,
                             solver={"step_s": 1e-4}, defect={"kind": "outer"}))  # fmt: skip


def test_a_shaft_that_hardly_turns_and_one_that_spins() -> None:
    """No passage at all, and far more of them than the mean speed lets expect."""
    short = {"model": "impulse", "defect": {"kind": "inner"}, "duration_s": 0.003, "settle_s": 0.0}
    slow = simulate(paper_scene(shaft_speed_rad_s=0.005, **short))
    assert slow.samples == 61
    assert abs(slow.acceleration_m_s2).max() == 0
    assert simulate(paper_scene(shaft_speed_rad_s=9e4, **short)).status is RunStatus.OK
    profile = SpeedProfile(time_s=(0.0, 10.0), speed_rad_s=(0.0, 100.0))  # its slow start made every pulse 10 s wide
    assert simulate(replace(paper_scene(**short), duration_s=10.0, speed_profile=profile)).samples == 204_800


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        ({"kind": "sobol", "ranges": {"load.radial_n": [1, 2]}, "samples": 2**62}, "must be between 0"),
        ({"kind": "latin-hypercube", "ranges": {"load.radial_n": [1, 2]}, "samples": 2**62}, "must be between 0"),
        ({"kind": "grid", "values": {str(i): list(range(100)) for i in range(9)}}, "cases; the limit"),
        ({"kind": "sobol", "ranges": {"load.radial_n": ["0 N", "1e400 N"]}, "samples": 2}, "least and the largest"),
        ({"kind": "sobol", "ranges": {f"k{i}": [1, 2] for i in range(30_000)}, "samples": 2}, "30000 keys"),
    ],
)
def test_campaigns_that_would_never_be_planned(axes: dict[str, object], message: str, tmp_path: Path) -> None:
    text = ", ".join(f"{key} = {toml(value)}" for key, value in axes.items())
    (tmp_path / "c.toml").write_text(f'name = "a"\naxes = [{{{text}}}]')
    with pytest.raises(ConfigurationError, match=message):
        plan_cases(load_campaign(str(tmp_path / "c.toml")))


def toml(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f'"{key}" = {toml(item)}' for key, item in value.items()) + "}"
    return repr(value)
