"""What the oil does to power, slip and cage ratio: over speed and load, each effect alone, over its ranges, over sizes.

Power stands beside SKF's moment of a spherical roller bearing (SKF Rolling bearings: the formulas
of table 2a were read, the constants of series 222 are quoted from memory, and so is Palmgren's moment, with f_1 =
0.0005 (P_0 / C_0)^0.5, not sure at all, and f_0 = 5, for circulating oil).

The trend is the cage ratio at 340 less that at 859 rpm, of two runs that differ in nothing else. Ranges of the oil are
those of ``rig_inputs.toml``, which were committed before the scene was first run.

Skidding sets in at the greatest load at which the cage lags by `ONSET_PCT`, the program's limit of slip under load; the
catalogue's least load is SKF's formula. Other sizes are geometrically similar to the 22240, with C_0 as the square of
the size and the reference speed as its inverse; SKF's own 22208 to 22260 have both within some per cent (quoted from
memory). Oil and roughness stay.
"""

import math
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from srbval.bearing import DEFAULT_BEARING, LARGEST_SLIP, load_bearing
from srbval.plan.measures import smooth_mean
from srbval.progress import Progress
from srbval.progress.tables import text_table
from srbval.scene import Oil, Scene, draws, load_scene, merge, rig_inputs
from srbval.studies.harness import StudyResult
from srbval.sweep.pool import Attempt, run_all

RECORDS_RPM = (340.074, 858.94)  # of the rig's outer-race records
SPEEDS_RPM = (127.0, 340.074, 600.0, 858.94, 1000.0)
RADIAL_KN, LOADS_KN = 124.8, (31.2, 62.4, 124.8, 250.0)
TABLE_5_KN = ((124.8, 0.0), (62.4, 0.0), (124.8, 24.5), (124.8, 49.0))  # Table 5's radial and axial loads
FREE_KN = (0.0, 6.25, 12.5, 18.0, 24.5)  # axial loads of pairs whose rollers tilt and slide along their axes
FREE = {"bodies": {"free_rollers": True}}
STEEP_KN = 15.0  # axial load from which free rollers need the fine step
HEAVY_KN = 150.0  # above it rollers bounce faster than the scene's step resolves
FINE_S = 1 / 81920
SETTLE_TURNS, TURNS = 3.0, 3.0
NONE = {"fill": 0, "pocket_friction": 0, "rolling_resistance": False}
CURVE = {"line_contact": {"traction": "lubricated"}}  # the scene `rig`'s traction
EFFECTS: Mapping[str, Mapping[str, Any]] = {
    "none": CURVE | {"oil": NONE},
    "film": {"oil": NONE},
    "rolling": CURVE | {"oil": NONE | {"rolling_resistance": True}},
    "drag": CURVE | {"oil": {"pocket_friction": 0, "rolling_resistance": False}},
    "pockets": CURVE | {"oil": {"fill": 0, "rolling_resistance": False}},
    "all": {},
}
DRAWS_POWER = 4  # 16 draws of all ranges at once
BORE_MM, OUTER_MM = 200.0, 360.0
STATIC_N = 1.93e6
R1, R3, S1, S3 = 1.6e-6, 2.81e-6, 3.62e-3, 8.8e-3  # radial load alone
PITCH_MM = {"22208": 60, "22216": 110, "22220": 140, "22230": 210, "22240": 280, "22260": 420}  # (bore + outer) / 2
OF_REFERENCE = (0.2, 0.54, 1.0)  # speeds over the reference speed: 859 rpm of a 22240 in the middle
OF_MINIMUM = (0.15, 0.25, 0.4, 0.6, 0.8, 1.0, 1.5)  # loads over the catalogue's least
ONSET_PCT = 100 * LARGEST_SLIP
OTHER_ONSETS_PCT = (0.5, 2.0)
Row = Mapping[str, Any]


def skf_power_w(oil: Oil, rpm: float, radial_n: float) -> float:
    """Rolling and sliding power by SKF's model, radial load, without drag and starvation."""
    mean_mm, flow = (BORE_MM + OUTER_MM) / 2, oil.kinematic_mm2_s() * rpm
    rolling = min(R1 * mean_mm**1.85 * radial_n**0.54, R3 * mean_mm**2.3 * radial_n**0.31)
    sliding = min(S1 * mean_mm**0.25 * radial_n ** (4 / 3), S3 * mean_mm**0.94 * radial_n)
    heated = 1 / (1 + 1.84e-9 * (rpm * mean_mm) ** 1.28 * oil.kinematic_mm2_s() ** 0.64)
    boundary = math.exp(-2.6e-8 * flow**1.4 * mean_mm)
    moment_nmm = heated * rolling * flow**0.6 + sliding * (0.15 * boundary + 0.05 * (1 - boundary))
    return moment_nmm * 1e-3 * rpm * math.pi / 30


def palmgren_power_w(oil: Oil, rpm: float, radial_n: float) -> float:
    """Load-dependent and viscous power by Palmgren."""
    mean_mm, flow = (BORE_MM + OUTER_MM) / 2, max(oil.kinematic_mm2_s() * rpm, 2000.0)
    moment_nmm = 0.0005 * (radial_n / STATIC_N) ** 0.5 * radial_n * mean_mm + 5e-7 * flow ** (2 / 3) * mean_mm**3
    return moment_nmm * 1e-3 * rpm * math.pi / 30


def scene_at(rpm: float, radial_kn: float, changes: Row, axial_kn: float = 0.0) -> Scene:
    """The scene `rig-oil` at a speed and loads with `changes`, settled and recorded for whole turns of the shaft."""
    own: dict[str, Any] = {
        "shaft_speed": f"{rpm} rpm", "duration_s": TURNS * 60 / rpm, "settle_s": SETTLE_TURNS * 60 / rpm,
        "load": {"radial": f"{radial_kn} kN", "axial": f"{axial_kn} kN"},
    }  # fmt: skip
    own |= {"solver": {"step_s": FINE_S}} if radial_kn > HEAVY_KN else {}
    return load_scene("rig-oil", merge(own, changes))


def pairs() -> dict[tuple[str, ...], tuple[Row, float, float]]:
    """Changes, radial and axial load [kN] of all that a trend is read from: effects, free rollers, ranges, draws."""
    found: dict[tuple[str, ...], tuple[Row, float, float]] = {
        ("effect", name, f"{radial:g}", f"{axial:g}"): (changes, radial, axial)
        for name, changes in EFFECTS.items() for radial, axial in TABLE_5_KN
    }  # fmt: skip
    fine = {"solver": {"step_s": FINE_S}}
    for name in ("none", "all"):
        found["step", name] = (merge(EFFECTS[name], fine), *TABLE_5_KN[0])
        for axial in FREE_KN:
            changes = merge(EFFECTS[name], FREE | (fine if axial > STEEP_KN else {}))
            found["free", name, f"{RADIAL_KN:g}", f"{axial:g}"] = (changes, RADIAL_KN, axial)
    inputs = rig_inputs("oil")
    for one in inputs:
        for end in (one.low, one.high):
            found["range", one.key, f"{end:g} {one.unit}".strip()] = (one.changes(end), *TABLE_5_KN[0])
    for number, changes in enumerate(draws(inputs, DRAWS_POWER)):
        found["draw", f"{number}"] = (changes, *TABLE_5_KN[0])
    return found


def similar_bearing(folder: Path, name: str) -> tuple[str, float]:
    """File of the bearing of this size, similar to the default one, written to `folder`; its reference speed [rpm]."""
    usual = load_bearing(DEFAULT_BEARING)
    assert usual.geometry is not None
    assert usual.ratings is not None
    size, ratings = PITCH_MM[name] / PITCH_MM["22240"], usual.ratings
    geometry = {key: value * size if key.endswith("_m") else value for key, value in vars(usual.geometry).items()}
    static_n, reference = ratings.static_load_n * size**2, ratings.reference_rad_s / size
    lines = [f'title = "similar to {name}"', 'source = "srbval.studies.oil_effects"', "[geometry]"]
    lines += [f"{key} = {value!r}" for key, value in geometry.items()]
    lines += ["[ratings]", f"static_load_n = {static_n!r}", f"reference_rad_s = {reference!r}"]
    path = folder / f"similar-{name}.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path), reference * 30 / math.pi


def onset_scenes(folder: Path) -> Iterator[tuple[tuple[str, float, float], tuple[Scene, float]]]:
    """Scenes, and the catalogue's least load [N], by size, speed over the reference speed, load over the least."""
    for name in PITCH_MM:
        path, reference = similar_bearing(folder, name)
        ratings = load_bearing(path).ratings
        assert ratings is not None
        for share in OF_REFERENCE:
            rpm = share * reference
            least_n = ratings.minimum_load_n(rpm * math.pi / 30)
            for load in OF_MINIMUM:
                changes = {"bearing": path} if name != "22240" else {}
                yield (name, share, load), (scene_at(rpm, load * least_n / 1e3, changes), least_n)


def onset(loads: Sequence[float], slips_pct: Sequence[float], limit_pct: float) -> float | None:
    """The greatest load at which slip, as it falls with the load, is `limit_pct`; None beyond the loads tried.

    Between two loads both are straight in their logarithms.
    """
    for i in range(len(loads) - 1, 0, -1):
        high, low = slips_pct[i - 1], slips_pct[i]
        if low < limit_pct <= high:
            share = math.log(high / limit_pct) / math.log(high / max(low, 1e-6))
            return float(loads[i - 1] * (loads[i] / loads[i - 1]) ** share)
    return None


def _read(_: Any, tried: Attempt, _wall_s: float) -> dict[str, Any]:
    """Status, cage ratio, slip, change of the cage's speed between halves, powers; of a failed run its status alone."""
    run = tried.run
    if run is None or not tried.works:
        return {"status": tried.status}
    ratio = smooth_mean(run.cage_rad_s) / run.scene.mean_shaft_rad_s
    half = len(run.cage_rad_s) // 2
    drift = 100 * float(run.cage_rad_s[half:].mean() / run.cage_rad_s[:half].mean() - 1)
    powers = {f"{name}_w": value for name, value in run.power_w.items()} | {"drive_w": run.drive_power_w}
    slip = 100 * (1 - ratio / run.rolling_ratio)
    return {"status": tried.status, "cage_ratio": ratio, "slip_pct": slip, "drift_pct": drift, **powers}


def power_rows(run: Callable[..., Any]) -> list[Row]:
    """Power over speed and over load by source, and both formulas beside it [W]."""
    cases = [(rpm, RADIAL_KN) for rpm in SPEEDS_RPM] + [
        (RECORDS_RPM[1], load) for load in LOADS_KN if load != RADIAL_KN
    ]
    found, oil = run({case: scene_at(*case, {}) for case in cases}, task="Power"), load_scene("rig-oil").oil
    assert oil is not None
    return [
        {"rpm": rpm, "radial_kn": load, **found[rpm, load], "skf_w": skf_power_w(oil, rpm, load * 1e3),
         "palmgren_w": palmgren_power_w(oil, rpm, load * 1e3)}
        for rpm, load in cases
    ]  # fmt: skip


def trend_rows(run: Callable[..., Any]) -> list[Row]:
    """Trend [%] of every one of `pairs`, and how far it lies beyond that of like rollers without oil at its load."""
    every = pairs()
    scenes = {(*key, rpm): scene_at(rpm, radial, changes, axial)
              for key, (changes, radial, axial) in every.items() for rpm in RECORDS_RPM}  # fmt: skip
    found, rows = run(scenes, task="Trend"), {}
    for key in every:
        slow, fast = (found[*key, rpm].get("cage_ratio") for rpm in RECORDS_RPM)
        trend = None if slow is None or fast is None else 100 * (slow / fast - 1)
        rows[key] = {"kind": key[0], "of": key[1], "value": key[2] if key[0] == "range" else None,
                     "radial_kn": every[key][1], "axial_kn": every[key][2], "cage_340": slow, "cage_859": fast,
                     "drift_pct": max(abs(found[*key, rpm].get("drift_pct", math.nan)) for rpm in RECORDS_RPM),
                     "trend_pct": trend}  # fmt: skip
    for (kind, *_), row in rows.items():
        same = kind if kind == "free" else "effect"
        bare = rows[same, "none", f"{row['radial_kn']:g}", f"{row['axial_kn']:g}"]["trend_pct"]
        both = bare is not None and row["trend_pct"] is not None
        row["beyond_pct"] = row["trend_pct"] - bare if both else None
    return list(rows.values())


def onset_rows(run: Callable[..., Any]) -> list[Row]:
    """For each size and speed the load at which skidding sets in over the catalogue's least, by each limit of slip."""
    with TemporaryDirectory() as folder:
        cases = dict(onset_scenes(Path(folder)))
        found = run({key: scene for key, (scene, _) in cases.items()}, task="Skidding")
    rows: list[Row] = []
    for name, share in dict.fromkeys(key[:2] for key in cases):
        own = [(load, found[name, share, load]) for load in OF_MINIMUM]
        known = [(load, one["slip_pct"]) for load, one in own if "slip_pct" in one]
        loads, slips = [load for load, _ in known], [slip for _, slip in known]
        scene, least_n = cases[name, share, OF_MINIMUM[0]]
        onsets = {f"onset_{limit:g}_pct": onset(loads, slips, limit) for limit in (ONSET_PCT, *OTHER_ONSETS_PCT)}
        rows.append({"bearing": name, "pitch_mm": PITCH_MM[name], "of_reference": share, "rpm": scene.shaft_hz * 60,
                     "least_kn": least_n / 1e3, "loads": loads, "slip_pct": slips, **onsets})  # fmt: skip
    return rows


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    runs = partial(run_all, read=_read, jobs=options.jobs, progress=progress)
    content = {"rows": power_rows(runs), "trend": trend_rows(runs), "onset": onset_rows(runs)}
    text = "\n\n".join(_text(name, rows) for name, rows in content.items())
    return StudyResult(name="oil_effects", content=content, text=text)


def _text(name: str, rows: Sequence[Row]) -> str:
    names = tuple(key for key in rows[0] if not isinstance(rows[0][key], list))
    cells = [[f"{v:.5g}" if isinstance(v := row.get(key), float) else v for key in names] for row in rows]
    return f"{name}\n{text_table(names, cells)}"
