"""What the oil does to power, slip and cage ratio: effects alone and together, over speed and load, beside formulas.

SKF's moment of a spherical roller bearing (SKF Rolling bearings, 2018: its formulas were read, the constants of
series 222 are quoted from memory, and so is Palmgren's moment, with f_1 = 0.0005 (P_0 / C_0)^0.5, not sure at all, and
f_0 = 5, for circulating oil).
"""

import math
from argparse import Namespace
from dataclasses import dataclass
from typing import Any

from srbval.models.run import RunSummary
from srbval.models.simulate import Step, simulate
from srbval.progress import Progress
from srbval.progress.tables import text_table
from srbval.scene import Oil, load_scene
from srbval.studies.harness import StudyResult

RECORDS_RPM = (340.074, 858.94)  # of the rig's outer-race records
SPEEDS_RPM = (127.0, 340.074, 600.0, 858.94, 1000.0)
LOADS_KN = (31.2, 62.4, 124.8, 250.0)
LIGHT_KN = (0.2, 1.0, 2.0, 4.0, 8.0, 11.4)
HEAVY_KN = 150.0  # above it rollers bounce faster than the scene's step resolves
NONE = {"fill": 0, "pocket_friction": 0, "rolling_resistance": False}
EFFECTS = {  # changes of [oil]; traction by the film is in all
    "film": NONE,
    "film, rolling": NONE | {"rolling_resistance": True},
    "film, drag": {"pocket_friction": 0, "rolling_resistance": False},
    "film, pockets": {"fill": 0, "rolling_resistance": False},
    "all": {},
}
BORE_MM, OUTER_MM = 200.0, 360.0
STATIC_N = 1.93e6
R1, R3, S1, S3 = 1.6e-6, 2.81e-6, 3.62e-3, 8.8e-3  # radial load alone


@dataclass(frozen=True, kw_only=True)
class OilRow:
    """One run of the scene `rig-oil`, and the power of both formulas [W]; `effects` of the oil that are on."""

    effects: str
    rpm: float
    radial_kn: float
    status: str
    cage_ratio: float
    slip_pct: float
    power_w: float
    sliding_w: float
    rolling_w: float
    drag_w: float
    skf_w: float
    palmgren_w: float


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


def row(effects: str, rpm: float, radial_kn: float) -> OilRow:
    """Run one case and set the formulas beside it."""
    changes: dict[str, Any] = {
        "shaft_speed": f"{rpm} rpm",
        "load": {"radial": f"{radial_kn} kN"},
        "oil": EFFECTS[effects],
    }
    if radial_kn > HEAVY_KN:
        changes["solver"] = {"step_s": 1 / 81920}
    run: RunSummary = simulate(
        load_scene("rig-oil", changes | {"duration": "0.3 s", "settle": "0.2 s"}), step=Step.UNCHECKED
    )
    oil, power = run.scene.oil, run.power_w
    assert oil is not None
    return OilRow(
        effects=effects, rpm=rpm, radial_kn=radial_kn, status=run.status.value, cage_ratio=run.cage_ratio,
        slip_pct=run.slip_pct, power_w=run.drive_power_w, sliding_w=power["sliding"], rolling_w=power["rolling"],
        drag_w=power["drag"], skf_w=skf_power_w(oil, rpm, radial_kn * 1e3),
        palmgren_w=palmgren_power_w(oil, rpm, radial_kn * 1e3),
    )  # fmt: skip


def run(_: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    cases = [(name, rpm, 124.8) for name in EFFECTS for rpm in RECORDS_RPM]
    cases += [("all", rpm, 124.8) for rpm in SPEEDS_RPM if rpm not in RECORDS_RPM]
    cases += [("all", RECORDS_RPM[1], load) for load in (*LIGHT_KN, *LOADS_KN) if load != 124.8]
    rows = []
    for number, case in enumerate(cases):
        rows.append(row(*case))
        progress("Oil", (number + 1) / len(cases))
    pairs = {name: [r.cage_ratio for r in rows if (r.effects, r.radial_kn) == (name, 124.8)] for name in EFFECTS}
    trend = {name: 100 * (pair[0] / pair[1] - 1) for name, pair in pairs.items()}
    names = tuple(vars(rows[0]))
    shown = text_table(names, [[f"{v:.6g}" if isinstance(v, float) else v for v in vars(r).values()] for r in rows])
    text = f"{shown}\n\n" + text_table(
        ("cage ratio, 340 less 859 rpm", "%"), [(n, f"{t:+.4f}") for n, t in trend.items()]
    )
    return StudyResult(name="oil_effects", content={"rows": rows, "trend_pct": trend}, text=text)
