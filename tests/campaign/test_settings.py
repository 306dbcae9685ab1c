"""Campaign files: axes, sampling, presets; what is refused and why."""

import re

import pytest

from srbval.campaign.cases import Campaign, plan_cases, presets, scene_of_point
from srbval.campaign.run import load_campaign
from srbval.errors import ConfigurationError
from srbval.storage.tables import build
from tests.campaign.campaigns import small


def points_of(*axes, **more):
    return list(build(Campaign, {"name": "c", "axes": list(axes)} | more, "c").points())


def test_blocks_multiply_and_a_seed_holds_for_all_cases():
    grid = {"kind": "grid", "values": {"shaft_speed": ["1 rpm", "2 rpm"], "load": {"radial": ["3 kN"]}}}
    together = {"kind": "zip", "values": {"contact.points_per_circle": [250, 500], "contact.stiffness": ["a", "b"]}}
    listed = {"kind": "list", "cases": [{"defect": {"kind": "outer"}}, {"defect.kind": "inner", "model": "planar"}]}
    found = points_of(grid, together, listed, seed=7)
    assert len(found) == 2 * 1 * 2 * 2
    assert {p["seed"] for p in found} == {7}
    assert points_of({"kind": "grid", "values": {"seed": [1, 2]}}, seed=7) == [{"seed": 1}, {"seed": 2}]
    first = {"shaft_speed": "1 rpm", "load.radial": "3 kN", "defect.kind": "outer", "seed": 7}
    assert found[0] == first | {"contact.points_per_circle": 250, "contact.stiffness": "a"}
    assert found[-1]["contact.stiffness"] == "b"
    assert found[-1]["model"] == "planar"


@pytest.mark.parametrize("kind", ["latin-hypercube", "sobol"])
def test_sampled_points_fill_the_ranges_and_repeat(kind):
    ranges = {"shaft_speed": ["100 rpm", "900 rpm"], "contact.static_friction": [0.1, 0.7]}
    axes = {"kind": kind, "samples": 16, "ranges": ranges}
    first, again, other = points_of(axes), points_of(axes), points_of(axes, seed=1)
    assert first == again
    assert first != [{k: v for k, v in p.items() if k != "seed"} for p in other]
    speeds = sorted(float(p["shaft_speed"].removesuffix(" rpm")) for p in first)
    # one point in each sixteenth of the range is what both methods promise
    assert [int((s - 100) / 800 * 16) for s in speeds] == list(range(16))
    assert all(0.1 <= p["contact.static_friction"] <= 0.7 for p in first)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"axes": [{"kind": "grid", "cases": [{"a": 1}]}]}, "needs values"),
        ({"name": "a/b"}, "only letters, digits"),
        ({"axes": [{"kind": "zip", "values": {"a": [1], "b": [1, 2]}}]}, "equally long; they have a 1, b 2"),
        ({"axes": [{"kind": "grid", "values": {"a": [n]}} for n in (1, 2)]}, "'a' is set twice"),
        ({"axes": [{"kind": "sobol", "samples": 12, "ranges": {"a": [0, 1]}}]}, "power of two, such as 16"),
        ({"axes": [{"kind": "sobol", "samples": 8, "ranges": {"a": ["1 rpm", "2 Hz"]}}]}, "in one unit"),
        ({"axes": [{"kind": "sobol", "samples": 8, "ranges": {"a": [2, 1]}}]}, "least and the largest"),
        ({"axes": [{"kind": "sobol", "samples": 2, "ranges": {"a": ["0 N", "1e400 N"]}}]}, "least and the largest"),
        ({"axes": [{"kind": "sobol", "samples": 2**62, "ranges": {"a": [1, 2]}}]}, "at least 0 and at most 2e"),
        ({"axes": [{"kind": "sobol", "samples": 2, "ranges": {f"k{i}": [1, 2] for i in range(30_000)}}]}, "30000"),
        ({"axes": [{"kind": "grid", "values": {str(i): list(range(100)) for i in range(9)}}]}, "cases; the limit"),
    ],
)
def test_wrong_files_are_refused(table, message):
    with pytest.raises(ConfigurationError, match=message):
        plan_cases(build(Campaign, {"name": "c"} | table, "c"))


@pytest.mark.parametrize(
    ("axis", "message"),
    [
        ('"load.radal" = ["1 kN"]', r"c, case 0: scene.load: .*'radial'\? Known: axial, "),
        ('"solver.name" = ["imex"]', r"case 0: .*'imex2'\? Known: imex1, "),
        ('seed = [1]\n[scene]\nmodl = "planar"', r"case 0: .*unknown key 'modl'"),
    ],
)
def test_a_typo_ends_before_anything_runs(axis, message, tmp_path, srbval_text):
    table, *more = axis.split("\n", 1)
    (tmp_path / "c.toml").write_text(
        "\n".join(['name = "c"', f'[[axes]]\nkind = "grid"\nvalues = {{ duration = ["1 s", "2 s"], {table} }}', *more])
    )
    assert re.search(message, srbval_text("campaign", "run", tmp_path / "c.toml", "-o", tmp_path / "c", code=2).err)
    assert [path.name for path in tmp_path.iterdir()] == ["c.toml"]


def test_names_of_results_follow_the_content():
    def key(**changes):
        return plan_cases(small(axes=[], **changes))[0].key

    same = {"duration": "0.005 s", "settle_s": 0.0, "model": "planar"}
    assert key() == key(scene=same) == key(name="other", title="another")
    assert key() != key(scene=same | {"seed": 1})
    assert key() != key(outputs=["summary"])


def test_a_scene_file_lies_below_the_scene(tmp_path):
    (tmp_path / "base.toml").write_text('duration = "1 s"\n[load]\nradial = "50 kN"\n')
    (tmp_path / "c.toml").write_text('name = "c"\nscene_file = "base.toml"\n[scene.load]\naxial = "2 kN"\n')
    scene = scene_of_point(load_campaign(str(tmp_path / "c.toml")), {})
    assert (scene.duration_s, scene.load.radial_n, scene.load.axial_n) == (1.0, 50e3, 2e3)


@pytest.mark.parametrize("name", ["table5", "table5-smoke"])
def test_presets_are_table_5_at_one_load(name):
    campaign = load_campaign(name)
    cases = plan_cases(campaign)
    scenes = [scene_of_point(campaign, case.point) for case in cases]
    assert name in presets()
    assert len({case.key for case in cases}) == len(cases) == 40
    assert len({s.shaft_speed_rad_s for s in scenes}) == 10
    assert len({s.defect.kind for s in scenes}) == 4
    assert {s.load.radial_n for s in scenes} == {124.8e3}
    assert {s.duration_s for s in scenes} == {10.0 if name == "table5" else 0.1}
