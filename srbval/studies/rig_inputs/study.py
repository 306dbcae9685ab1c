"""The rig scene's cage speed over its inputs' ranges, against the rig's.

Each input alone from its lowest to its highest value, then all of them together, drawn from their ranges. Ratios of
cage and shaft are compared after ASME V&V 20: error E = S - D against the uncertainty U of inputs, numerics and data.
The rig's ratios are read from its registered recordings; `--read-again` reads only these again and keeps the stored
runs.

A study is a mapping, as it is stored: the record that it is `of` (see `rig_line`), the `nominal` cage ratio, a `finer`
run's, those of other `starts`, the `effects` of each input alone, the ratios of `drawn` inputs, and what `scored` adds.
"""

import math
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.check.quantities import RIG_RPM
from srbval.comparison.budget import TOLERANCE
from srbval.comparison.comparison import deviation_pct
from srbval.comparison.speed_and_slip import published_speeds
from srbval.errors import DataError, NumericsError
from srbval.models.simulate import Step, simulate
from srbval.progress import Progress, silent
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.recordings.registry import find_recording, load_entry
from srbval.scene import RigInput, draws, load_scene, merge, rig_inputs
from srbval.storage.stored_result import newest_result
from srbval.studies.harness import Study, StudyResult, input_hashes

SETTLE_S, SECONDS = 0.05, 0.1  # twelve passages; the cage ratio differs from that of two seconds by less than 1e-6
STEP_S = 1 / 61_440  # the scene's own is beyond the stiffest roller's limit where contacts are longest
STARTS = 8  # runs that differ by the load's last digits
START_SHARE = 1e-5  # of the load
FINER = {"line_contact": {"slices": 61}, "solver": {"step_s": STEP_S / 4}}
DRAWN = 7  # power of two: samples of all inputs together
COVERAGE = 2.0  # of a standard uncertainty, for 95 %
MARGIN_PCT = TOLERANCE.limit_pct  # of the cage ratio: the difference within which model and rig count as agreeing
AGREE = "agree"  # |E| + U is below the margin: nearly uniform ranges rule U, so that no one-sided 1.645 u will do
RESOLVED = "resolved"  # E exceeds U: the model's error shows
UNDECIDED = "undecided"  # E is within U, which is too wide for more
BEARING = load_bearing(DEFAULT_BEARING)
# Nominal speed, race and, where no recording can be had, the order that was read from it over the mean speed, which has
# no interval: shown, not judged.
RECORDS = {
    "OR 877": (RIG_RPM, Fault.OUTER, None),
    "IR 877": (RIG_RPM, Fault.INNER, None),
    "OR 353": (353.0, Fault.OUTER, 8.192),
    "IR 353": (353.0, Fault.INNER, 10.795),
}
Row = Mapping[str, Any]


def rig_line(record: str) -> dict[str, Any]:
    """A record at the mean speed that its authors print: read from the registered recording, else as stored.

    The cage ratio read from its fault line, and its standard uncertainty where that is known: of the line's reading and
    of the shaft's mean speed over the tachometer's scatter and drift, as `analyse` states both. `DataError` where
    neither recording nor stored study is there.
    """
    nominal_rpm, kind, order = RECORDS[record]
    uncertainty = None
    if order is None:
        entry = find_recording(state=kind, nominal_rpm=nominal_rpm)
        if entry is None:
            return stored_line(record)
        analysis = analyse(load_entry(entry), bearing=BEARING)
        line, speed = analysis.line_of(kind), analysis.speed
        if line.found_hz is None or line.ci95_hz is None:
            raise DataError(f"{entry.file}: no {kind.line}.")
        order = line.found_hz / speed.value_hz
        relative = math.hypot(line.ci95_hz / line.found_hz, speed.ci95_hz / speed.value_hz)
        uncertainty = order * relative / COVERAGE / BEARING.rolling_elements
    rpm = next(m.mean_rpm for m in published_speeds().means if (m.state, m.nominal_rpm) == (kind, nominal_rpm))
    return {
        "record": record, "line": kind.line, "kind": kind.value, "rpm": rpm,
        "cage_ratio": share(kind.value, order / BEARING.rolling_elements), "standard_uncertainty": uncertainty,
    }  # fmt: skip


def stored_line(record: str) -> dict[str, Any]:
    """A record as the stored study has it."""
    kept = newest_result("rig_inputs")
    if kept is None:
        raise DataError(f"{record}: neither registered nor in a stored study; srbval data fetch torino-excerpts.")
    return next(dict(study["of"]) for study in kept.content["studies"] if study["of"]["record"] == record)


def share(kind: str, ratio: float) -> float:
    """The line over shaft speed and number of rollers, of a cage ratio; or the ratio again."""
    return ratio if kind == Fault.OUTER else 1 - ratio


def scored(study: Row) -> dict[str, Any]:
    """A study with `error_pct` E of the line, `parts_pct` and `uncertainty_pct` U (95 % half widths) and the `verdict`.

    Parts in per cent of the line: inputs one by one, those drawn together, numerics, data; U has the greater of the
    inputs' two. It and the verdict (see `AGREE`, `RESOLVED`, `UNDECIDED`) are None where the data's is not known.
    """
    of, nominal = study["of"], study["nominal"]
    line = share(of["kind"], of["cage_ratio"])
    low, high = np.percentile(study["drawn"], (2.5, 97.5))
    widths = {
        "inputs": math.hypot(*((max(e["cage_ratios"]) - min(e["cage_ratios"])) / 2 for e in study["effects"])),
        "inputs together": float(high - low) / 2,
        "numerics": math.hypot(study["finer"] - nominal, COVERAGE * float(np.std(study["starts"], ddof=1))),
    }
    if of["standard_uncertainty"] is not None:
        widths["data"] = COVERAGE * of["standard_uncertainty"]
    parts = {name: 100 * width / line for name, width in widths.items()}
    error, u, verdict = deviation_pct(share(of["kind"], nominal), line), None, None
    if "data" in parts:
        u = math.hypot(max(parts["inputs"], parts["inputs together"]), parts["numerics"], parts["data"])
        of_cage = line / of["cage_ratio"]  # from the line's per cent to the cage ratio's
        verdict = RESOLVED if abs(error) > u else UNDECIDED
        verdict = AGREE if of_cage * (abs(error) + u) < MARGIN_PCT else verdict
    return {**study, "error_pct": error, "parts_pct": parts, "uncertainty_pct": u, "verdict": verdict}


def study_inputs(
    line: Row, inputs: Sequence[RigInput], *, drawn: int = DRAWN, progress: Progress = silent
) -> dict[str, Any]:
    """Run the scene of `line` over the ranges of `inputs`, and ``2**drawn`` times with all of them drawn.

    Raises `NumericsError` where a run fails.
    """
    what, effects = f"{line['record']}: inputs", []
    load_n = load_scene("rig").load.radial_n
    for number, one in enumerate(inputs):
        progress(what, number / (len(inputs) + 2))
        ratios = [cage_ratio(line, one.changes(value)) for value in one.values]
        effects.append({"key": one.key, "unit": one.unit, "values": list(one.values), "cage_ratios": ratios})
    progress(what, len(inputs) / (len(inputs) + 2))
    together = [cage_ratio(line, changes) for changes in draws(inputs, drawn)]
    progress(what, 1.0)
    loads = load_n * (1 + np.linspace(-START_SHARE, START_SHARE, STARTS))
    return scored({
        "of": line, "nominal": cage_ratio(line, {}), "finer": cage_ratio(line, FINER),
        "starts": [cage_ratio(line, {"load": {"radial_n": load}}) for load in loads.tolist()],
        "effects": effects, "drawn": together,
    })  # fmt: skip


def cage_ratio(line: Row, changes: Mapping[str, Any]) -> float:
    """Of a run of the rig scene at the speed of a record, with its defect and these changes."""
    own = {
        "defect": {"kind": line["kind"]}, "shaft_speed": f"{line['rpm']} rpm", "settle_s": SETTLE_S,
        "duration_s": SECONDS, "solver": {"step_s": STEP_S},
    }  # fmt: skip
    run = simulate(load_scene("rig", merge(own, changes)), step=Step.UNCHECKED)  # that is part of the study
    if not run.status.usable:
        raise NumericsError(f"rig inputs: the run with {changes} failed ({run.status}): {run.reason}")
    return run.cage_ratio


def effect_rows(study: Row) -> Iterator[dict[str, Any]]:
    """One row for each input: its range, and what the cage ratio does over it."""
    line = share(study["of"]["kind"], study["of"]["cage_ratio"])
    for one in study["effects"]:
        ratios = one["cage_ratios"]
        yield {
            "record": study["of"]["record"], "input": one["key"], "low": one["values"][0], "high": one["values"][-1],
            "unit": one["unit"], "cage ratio at low": f"{ratios[0]:.6f}", "at high": f"{ratios[-1]:.6f}",
            "least": f"{min(ratios):.6f}", "greatest": f"{max(ratios):.6f}",
            "half spread [% of the line]": 50 * (max(ratios) - min(ratios)) / line,
        }  # fmt: skip


def summary_row(study: Row) -> dict[str, Any]:
    """Nominal value, spreads, and E against U."""
    of, parts = study["of"], study["parts_pct"]
    low, high = np.percentile(study["drawn"], (2.5, 97.5))
    return {
        "record": of["record"], "line": of["line"], "rpm": f"{of['rpm']:.2f}", "rig": f"{of['cage_ratio']:.5f}",
        "nominal": f"{study['nominal']:.6f}", "95 % of draws": f"{low:.5f}-{high:.5f}", "E [%]": study["error_pct"],
        **{f"{name} [%]": parts.get(name) for name in ("inputs", "inputs together", "numerics", "data")},
        "U [%]": study["uncertainty_pct"], "verdict": study["verdict"],
    }  # fmt: skip


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--read-again", action="store_true", help="read the rig's lines again, keep the stored runs")


def _run(options: Namespace, progress: Progress) -> StudyResult:
    kept, ran = newest_result("rig_inputs"), {}
    if options.read_again and kept is not None:
        studies = [scored({**study, "of": rig_line(study["of"]["record"])}) for study in kept.content["studies"]]
        ran = {"runs_of": kept.content.get("runs_of", kept.origin)}
    else:
        studies = [study_inputs(rig_line(record), rig_inputs(), progress=progress) for record in RECORDS]
    text = "\n\n".join(text_rows(list(rows)) for rows in (*map(effect_rows, studies), map(summary_row, studies)))
    read = (find_recording(state=kind, nominal_rpm=rpm) for rpm, kind, order in RECORDS.values() if order is None)
    return StudyResult(
        name="rig_inputs", content=ran | {"seconds": SECONDS, "studies": studies}, text=text, inputs=input_hashes(*read)
    )


STUDY = Study(
    question="Where does the rig scene's cage speed lie over the ranges of its inputs, and where does the rig's?",
    minutes=40, run=_run, options=_options,
)  # fmt: skip
