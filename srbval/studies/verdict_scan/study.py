"""What would be stated of the cage ratio if one open thing were known: each input alone over its whole range.

The joint draws of `sensitivity` give the error's uncertainty; here one value after the other is put in, all else
nominal, and compared with the tolerance, with the record's own uncertainty. What turns the answer is what leaves the
question unresolved. Model: every input of `budget.toml`, points on a circle, continuous contacts, Table 1's last
digits. Record: band, comb, kinematics, reading, speed. The scene ``rig`` is taken from its own stored study.
"""

import dataclasses
import math
import tempfile
from argparse import Namespace
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from srbval.bearing import DEFAULT_BEARING, RACE_DEFECTS, Fault, FaultOrders, load_bearing
from srbval.comparison.budget import SCAN, TOLERANCE
from srbval.comparison.compared_quantities import cage_of, cage_ratio
from srbval.comparison.comparison import QuantityValue, deviation_pct
from srbval.comparison.counterpart import TURNS, AnalysedRun, converged, with_points
from srbval.comparison.speed_and_slip import published_speeds
from srbval.comparison.table6 import table6
from srbval.errors import DataError, NumericsError
from srbval.models.simulate import Step, simulate
from srbval.progress import Progress, silent
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings.registry import RegisteredRecording, find_recording, load_entry
from srbval.scene import Scene
from srbval.storage.json_files import to_json
from srbval.storage.stored_result import newest_result
from srbval.studies.harness import Study, StudyResult, input_hashes, printed_columns
from srbval.studies.input_effects import NOMINAL_RPM, paper_scenes, run_unchecked
from srbval.studies.open_inputs import BAND, OpenInput, drawn, open_inputs

Row = dict[str, Any]
NOMINAL = "all nominal"
HARMONICS = range(1, 6)
HALF_DIGITS = (-SCAN.half_digit_m, 0.0, SCAN.half_digit_m)


@dataclass(frozen=True)
class _Record:
    """A record of the rig and the model's scene at its speed."""

    state: Fault
    rig: Analysis
    scene: Scene

    def row(self, kind: str, name: str, pairs: Iterable[tuple[str, float, QuantityValue | None]], **of: str) -> Row:
        """The cage ratio's error at each value of what is varied: the model's ratio against the record's.

        That is by default the one as it stands in the comparison; `ci95_pct` is the 95 % half width that the record
        leaves, `answers` what would be stated.
        """
        own = cage_ratio(self.rig, self.state)
        found = [(value, deviation_pct(model, one.value), 100 * math.hypot(one.ci95 or 0.0, one.speed_ci95) / one.value)
                 for value, model, rig in pairs if (one := rig or own)]  # fmt: skip
        return {
            "scene": of.get("scene", "paper"), "defect": self.state, "kind": kind, "name": name,
            "values": [value for value, *_ in found], "errors_pct": [error for _, error, _ in found],
            "ci95_pct": [u for *_, u in found], "answers": [TOLERANCE.answer(error, u) for _, error, u in found],
        }  # fmt: skip


def entry_of(state: Fault) -> RegisteredRecording:
    """The rig's record with a fault of a race; `DataError` where there is none."""
    entry = find_recording(state=state, nominal_rpm=NOMINAL_RPM)
    if entry is None:
        raise DataError(f"no recording of the rig with a fault of the {state} race at {NOMINAL_RPM:g} rpm is there.")
    return entry


def scan(rig_study: Mapping[str, Any] | None, *, progress: Progress = silent) -> list[Row]:
    """All rows, of both races; `rig_study` is the stored study of the scene ``rig``.

    Raises `DataError` without a record of either race, and what running the model raises.
    """
    rows, bearing = list[Row](), load_bearing(DEFAULT_BEARING)
    for scene in paper_scenes(TURNS):
        state = scene.defect.kind
        if state in RACE_DEFECTS:
            record = _Record(state, analyse(load_entry(entry_of(state)), bearing=bearing), converged(scene))
            rows += _model_rows(record, progress)
            rows += _rig_scene_rows(record, (rig_study or {}).get("studies", ()))
    return rows


def _model_rows(record: _Record, progress: Progress) -> Iterator[Row]:
    """Everything of the paper's scene, and of how the record is read against its nominal run."""
    what, nominal = f"Scan each input, {record.state}", run_unchecked(record.scene)
    own = nominal.values["cage ratio"].value
    yield record.row(NOMINAL, "", [("", own, None)])
    base = dataclasses.replace(record.scene, duration_s=SCAN.turns / TURNS * record.scene.duration_s)
    lengths = {f"{TURNS:g} turns": record.scene, f"{SCAN.turns:g} turns": base}
    inputs = open_inputs()
    for number, one in enumerate(inputs):
        progress(what, number / len(inputs))
        yield record.row(
            "input", one.name, [(_shown(one, at), _ratio_at(one, at, base, nominal), None) for at in _shares(one)]
        )
    more: list[tuple[str, str, Mapping[str, Scene]]] = [
        ("numerics", "length of the run", lengths),
        ("numerics", "points on a circle", {f"{n}": with_points(base, n) for n in SCAN.circle_points}),
        ("numerics", "solver's step", {f"{part:g} of it": _with_step(base, part) for part in (1.0, 0.5)}),
        ("model", "contact", {"points": base, "slices": dataclasses.replace(base, model="slices")}),
    ]
    with tempfile.TemporaryDirectory(prefix="srbval-") as folder:
        for names in (("pitch_radius_m", "inner_centre_radial_m"), ("inner_centre_axial_m",)):
            files = {f"{1e6 * by:+g} um": _bearing_file(Path(folder), names, by) for by in HALF_DIGITS}
            moved = {label: dataclasses.replace(base, bearing=file) for label, file in files.items()}
            more.append(("geometry", f"last digit of {names[0].removesuffix('_m').replace('_', ' ')}", moved))
        for kind, name, scenes in more:
            yield record.row(kind, name, [(label, _cage(scene), None) for label, scene in scenes.items()])
    yield from _reading_rows(record, own)
    progress(what, 1.0)


def _reading_rows(record: _Record, model: float) -> Iterator[Row]:
    """The record's band, and with it its comb, the kinematics that it is searched about, its reading and speed."""
    rig, state = record.rig, record.state
    bands = {f"{low:g} to {high:g} Hz": _read(record, band_hz=(low, high)) for low, high in SCAN.bands_hz}
    yield record.row("record", "band and comb", [(label, model, read) for label, read in bands.items() if read])
    about = {label: _read(record, orders=orders) for label, orders in _kinematics(rig).items()}
    yield record.row("record", "kinematics searched about", [(n, model, read) for n, read in about.items() if read])
    read = {f"harmonic {h} alone": _by_frequency(record, *_harmonic(record, h)) for h in HARMONICS}
    spectrum, line = rig.processed.spectrum, rig.line_of(state)
    near = np.abs(spectrum.frequency_hz / line.kinematic_hz - 1) < 0.01
    highest = float(spectrum.frequency_hz[near][np.argmax(spectrum.amplitude[near])])
    read["highest line"] = _by_frequency(record, highest, (line.resolution_hz or 0.0) / 2)
    yield record.row("record", "reading", [("all harmonics", model, None), *((n, model, q) for n, q in read.items())])
    rpm = next(m.mean_rpm for m in published_speeds().means if (m.state, m.nominal_rpm) == (state, NOMINAL_RPM))
    own = _by_frequency(record, *_harmonic(record, 1), shaft_hz=rpm / 60)
    yield record.row(
        "record", "shaft speed", [("tachometer", model, None), ("mean that its authors print", model, own)]
    )


def _rig_scene_rows(record: _Record, studies: Iterable[Mapping[str, Any]]) -> Iterator[Row]:
    """Those of the scene ``rig``, by its stored study of the same record."""
    for study in studies:
        if study["of"]["kind"] != record.state or study["uncertainty_pct"] is None:
            continue
        yield record.row(NOMINAL, "", [("", study["nominal"], None)], scene="rig")
        for effect in study["effects"]:
            at = zip(effect["values"], effect["cage_ratios"], strict=True)
            pairs = [(f"{value:g} {effect['unit']}".strip(), ratio, None) for value, ratio in at]
            yield record.row("input", effect["key"], pairs, scene="rig")


def _shares(one: OpenInput) -> list[float]:
    """Of the probability: every choice, or evenly from one end to the other."""
    if one.choices:
        return [sum(one.weights[:place]) for place in range(len(one.choices))]
    return np.linspace(0, 1, SCAN.log_points if one.log else SCAN.points).tolist()


def _shown(one: OpenInput, share: float) -> str:
    value = one.value(share)
    return value if isinstance(value, str) else f"{value:.4g}" + " of nominal" * one.relative


def _ratio_at(one: OpenInput, share: float, base: Scene, nominal: AnalysedRun) -> float:
    """The model's ratio: by its cage, and where the band is varied by the line that its own spectrum shows in it."""
    scene, band_hz = drawn([one], base, [share])
    if not one.keys[0].startswith(BAND):
        return _cage(scene)
    run = nominal.analysis
    read = cage_ratio(analyse(run.recording, bearing=run.bearing, band_hz=band_hz), scene.defect.kind)
    assert read is not None, "the model's line stands in every band of its range"
    return read.value


def _cage(scene: Scene) -> float:
    run = simulate(scene, step=Step.UNCHECKED)
    if not run.status.usable:
        raise NumericsError(f"scan: a run failed ({run.status}): {run.reason}.")
    return run.cage_ratio


def _with_step(scene: Scene, share: float) -> Scene:
    return dataclasses.replace(scene, solver=dataclasses.replace(scene.solver, step_s=share * scene.solver.step_s))


def _bearing_file(folder: Path, names: Sequence[str], by_m: float) -> str:
    """The default bearing with lengths off: the first by `by_m`, one after it, printed as its double, by twice that."""
    geometry = load_bearing(DEFAULT_BEARING).geometry
    assert geometry is not None, "the default bearing is the one that the model runs"
    values = {field.name: getattr(geometry, field.name) for field in dataclasses.fields(geometry)}
    for times, name in enumerate(names, start=1):
        values[name] += times * by_m
    path = folder / f"{names[0]}{by_m:+g}.toml"
    lines = ['title = "last digit"', 'source = "Table 1"', "[geometry]", *(f"{k} = {v!r}" for k, v in values.items())]
    path.write_text("\n".join(lines) + "\n")
    return str(path)


def _read(
    record: _Record, *, band_hz: tuple[float, float] | None = None, orders: FaultOrders | None = None
) -> QuantityValue | None:
    """The record's ratio read otherwise; None where the line is not detected then."""
    bearing = record.rig.bearing if orders is None else dataclasses.replace(record.rig.bearing, orders=orders)
    found = cage_ratio(analyse(record.rig.recording, bearing=bearing, band_hz=band_hz), record.state)
    return found if found is not None and found.present else None


def _kinematics(rig: Analysis) -> dict[str, FaultOrders]:
    """Computed with the diameter that just touches, with the printed one, and as Table 6 prints them."""
    geometry, printed, own = rig.bearing.geometry, table6(), rig.bearing.orders
    assert geometry is not None, "the default bearing is the one that the model runs"
    by_diameter = {
        name: FaultOrders.from_dimensions(
            rolling_elements=geometry.rollers_per_row, element_diameter_m=diameter,
            pitch_diameter_m=2 * geometry.pitch_radius_m, contact_angle_rad=geometry.tilt_rad,
        )
        for name, diameter in (
            ("diameter that touches", geometry.zero_play_diameter_m), ("printed diameter", geometry.roller_diameter_m),
        )
    }  # fmt: skip
    orders = {row.line.lower(): 60 * row.kinematic_hz / printed.shaft_rpm for row in printed.row}
    return by_diameter | {"as Table 6 prints": dataclasses.replace(own, **orders)}


def _harmonic(record: _Record, number: int) -> tuple[float, float]:
    """Frequency of the line by one of its harmonics, and its 95 % half width [Hz]."""
    line = record.rig.line(record.state.line or "", number)
    return (line.found_hz or math.nan) / number, (line.ci95_hz or 0.0) / number


def _by_frequency(record: _Record, hz: float, ci95_hz: float, *, shaft_hz: float | None = None) -> QuantityValue:
    """The record's ratio from a frequency of its line; the shaft's uncertainty is the tachometer's."""
    own, rollers = record.rig.speed, record.rig.bearing.rolling_elements
    order = hz / (shaft_hz or own.value_hz)
    per_order = ci95_hz / own.value_hz
    value = cage_of(record.state, order, rollers)
    return QuantityValue(value=value, ci95=per_order / rollers, speed_ci95=order * own.ci95_hz / own.value_hz / rollers)


def _run(_: Namespace, progress: Progress) -> StudyResult:
    rig = newest_result("rig_inputs")
    rows = to_json(scan(rig.content if rig else None, progress=progress))
    shown = [
        row | {
            "first": row["values"][0], "last": row["values"][-1], "least_pct": min(row["errors_pct"]),
            "largest_pct": max(row["errors_pct"]), "would_state": ", ".join(dict.fromkeys(row["answers"])),
        }
        for row in rows
    ]  # fmt: skip
    return StudyResult(
        name="verdict_scan", content={"rig_scene": rig and rig.origin, "rows": rows},
        text=printed_columns(__package__, "scan", shown), inputs=input_hashes(rig, *map(entry_of, RACE_DEFECTS)),
    )  # fmt: skip


STUDY = Study(
    question="What would be stated of the cage ratio with each uncertain input alone over its range?", minutes=2,
    run=_run,
)  # fmt: skip
