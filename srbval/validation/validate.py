"""Command `validate`: compares pairs of simulated and measured signals, a few pairs at a time to limit memory."""

import dataclasses
import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from srbval.bearing import RACE_DEFECTS, Bearing, Fault
from srbval.bridges import NotebookObject
from srbval.comparison.compared_quantities import RACE_LINE, Effects, biases, effects_of
from srbval.comparison.comparison import Row, Verdict, comparison_frame, plain_frame
from srbval.comparison.table6 import check_race_sum
from srbval.errors import ConfigurationError, NumericsError, SrbvalError
from srbval.processes.machine import usable_cores
from srbval.processes.worker import wait_for_result
from srbval.progress import Progress, silent
from srbval.recordings.registry import RecordSource
from srbval.storage.stored_result import newest_result
from srbval.validation.case import CasePair, ValidationCase, case_of_signals, load_case
from srbval.validation.compare import compare_pair, same_speed, table_of
from srbval.validation.sides import SideReading, load_files, read_files, registered_pairs, run_scene, stated_state

SIDES = ("simulated", "measured")
MAX_SUM_SPEED_DIFFERENCE = 0.01  # relative difference of speeds up to which two race lines are added


@dataclass(frozen=True, kw_only=True, eq=False)
class PairReading:
    """Analysed pair of simulated and measured signals, which are its `sides`, with a row for each compared quantity.

    `problem` is the reason for the failure of a simulation, in which case the simulated side is missing.
    """

    number: int
    pair: CasePair
    state: Fault
    sides: Mapping[str, SideReading]
    rows: tuple[Row, ...]
    problem: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Validation(NotebookObject):
    """Result of comparing pairs of simulated and measured signals; `pairs` has a row for each pair.

    `table` has a row for each pair and quantity, made from the rows `comparisons` of `compare_pair`. `sums` are checks
    of the sum of BPFO and BPFI (see `check_race_sum`). `failed` contains pairs that could not be compared, and why.
    """

    case: ValidationCase
    table: pd.DataFrame
    pairs: pd.DataFrame
    comparisons: tuple[Row, ...]
    sums: tuple[Row, ...]
    failed: tuple[Row, ...]

    @property
    def verdicts(self) -> dict[str, int]:
        """Number of compared quantities with each verdict."""
        return _count_verdicts(self.table)

    @property
    def holds(self) -> bool:
        """True unless a stated tolerance is missed."""
        return Verdict.MISSED.value not in self.verdicts

    @property
    def errors_pct(self) -> list[Row]:
        """Rows of the table with an error in per cent: lines and cage ratios found on both sides."""
        rows: list[Row] = self.table[self.table["error_unit"] == "%"].to_dict("records")
        return [row for row in rows if row["error"] is not None]

    @cached_property
    def bias(self) -> list[Row]:
        """Mean error of each kind of quantity over the records; see `compared_quantities.biases`."""
        return list(biases(comparison_frame(self.comparisons)))

    @property
    def headline(self) -> str:
        """Summary in one sentence: verdicts and largest error of lines and cage ratios, then of levels."""
        known, parts = self.table[self.table["error"].notna()], []
        if known.empty:
            return "No quantity was found on both sides."
        if set(known["verdict"]) == {Verdict.INSUFFICIENT.value}:
            parts.append("No verdict: the uncertainty of the simulation or of a reading is not known")
        for what, unit in (("lines and cage ratios", "%"), ("levels", "dB")):
            if len(rows := known[known["error_unit"] == unit]):
                counts = ", ".join(f"{count} {verdict}" for verdict, count in _count_verdicts(rows).items())
                worst = rows.loc[rows["error"].astype(float).abs().idxmax()]
                error = f"{worst['error']:+.2f} {unit} ({worst['quantity']})"
                parts.append(f"{len(rows)} {what}: {counts}, largest error {error}")
        return "; ".join(parts) + "."

    def to_dict(self) -> dict[str, Any]:
        """JSON document of `srbval validate`, without the paths of the report's files."""
        return {
            "case": self.case.title,
            "headline": self.headline,
            "bearing": self.case.known_bearing.name,
            "pairs": self.pairs.to_dict("records"),
            "table": self.table.to_dict("records"),
            "sums": self.sums,
            "bias": self.bias,
            "published": self.case.published,
            "failed": self.failed,
        }

    def __repr__(self) -> str:
        return f"<Validation of {self.case.title!r}: {self.headline}>"

    def to_frame(self) -> pd.DataFrame:
        """Table of the comparison, with one row for each pair of signals and quantity."""
        return self.table

    def summary_table(self) -> tuple[str, list[Row]]:
        """Headline and rows of the comparison for a notebook."""
        return self.headline, self.table.drop(columns=["parts", "simulated_hz", "measured_hz"]).to_dict("records")


def validate(
    case: ValidationCase | str | Path | None = None,
    changes: Mapping[str, Any] | None = None,
    *,
    simulated: RecordSource | Sequence[RecordSource] = (),
    measured: RecordSource | Sequence[RecordSource] = (),
    state: str | None = None,
    bearing: Bearing | str | Path | None = None,
    found: Callable[[PairReading], None] = lambda _: None,
    jobs: int | None = None,
    progress: Progress = silent,
) -> Validation:
    """Compare all pairs of simulated and measured signals of a case (object, file, name); `changes` as in `load_case`.

    Instead of a case, `simulated` and `measured` signals of one comparison can be given (see `case_of_signals`). `jobs`
    pairs are read in parallel; `found` is called with each pair in order. Raises the error of the first pair if no pair
    can be compared.
    """
    if case is None:
        case = case_of_signals(simulated, measured, changes, state=state, bearing=bearing)
    elif not isinstance(case, ValidationCase):
        case = load_case(case, changes)
    elif changes:
        raise ConfigurationError("the argument changes needs a case file; use dataclasses.replace on a ValidationCase.")
    case = dataclasses.replace(case, pair=tuple(one for pair in case.pair for one in registered_pairs(pair)))
    stored = newest_result("inputs")
    effects = effects_of(stored.content) if stored is not None else {}

    progress("compare the pairs", 0.0)
    rows, pairs, failed = list[Row](), list[Row](), dict[int, SrbvalError]()
    for number, future in enumerate(_start_pairs(case, effects, jobs or usable_cores(), progress), start=1):
        try:
            one = wait_for_result(future)
        except SrbvalError as error:
            failed[number] = error
        else:
            rows += one.rows
            pairs.append(pair_row(one))
            found(one)
        progress("compare the pairs", number / len(case.pair))
    if not pairs:
        raise next(iter(failed.values()))
    return Validation(
        case=case,
        table=table_of(rows, case.tolerance),
        pairs=plain_frame(pairs),
        comparisons=tuple(rows),
        sums=tuple(check_pair_sums(rows, case.known_bearing.rolling_elements)),
        failed=tuple({"pair": number, "reason": str(error)} for number, error in failed.items()),
    )


def _start_pairs(
    case: ValidationCase, effects: Effects, jobs: int, progress: Progress
) -> Iterator[Future[PairReading]]:
    """Read and compare `jobs` pairs at a time, and yield their future results in order; the caller waits for each."""
    waiting = deque[Future[PairReading]]()
    with ThreadPoolExecutor(jobs) as pool:
        for number, pair in enumerate(case.pair, start=1):
            waiting.append(pool.submit(_read_and_compare, number, pair, case, effects, progress))
            if len(waiting) >= jobs:
                yield waiting.popleft()
        yield from waiting


def _read_and_compare(
    number: int, pair: CasePair, case: ValidationCase, effects: Effects, progress: Progress
) -> PairReading:
    """Read and compare simulated and measured signals; `problem` of the result states a failure of the simulation."""
    sources = {side: source for side in SIDES if (source := case.side(pair, side)) is not None}
    scene = sources.pop("simulated") if "simulated" in sources and sources["simulated"].scene is not None else None
    if (scene is not None and scene.file) or any(source.scene for source in sources.values()):
        raise ConfigurationError("the simulated side needs either files or a scene, the measured side files.")
    loaded = {side: load_files(source, case.folder, side) for side, source in sources.items()}
    if empty := next((side for side, files in loaded.items() if not files), None):
        raise ConfigurationError(f"{empty} side: no file is named; give at least one.")
    state = stated_state(pair.state, tuple(recording for side in loaded.values() for recording in side))
    sides = {side: read_files(found, sources[side], case.known_bearing, state) for side, found in loaded.items()}
    problem = ""
    if scene is not None:
        if "measured" not in sides:
            raise ConfigurationError("a scene is simulated at the speed of a measured record; add one to the pair.")
        try:
            sides = {"simulated": run_scene(scene, case, sides["measured"], state, progress=progress), **sides}
        except NumericsError as error:
            problem = str(error)
    rows = tuple(compare_pair(number, state, sides, case, effects, pair.used_for))
    return PairReading(number=number, pair=pair, state=state, sides=sides, rows=rows, problem=problem)


def pair_row(one: PairReading) -> Row:
    """Row of `Validation.pairs`: files, speeds, frequency bands and warnings of the simulated and measured signals."""
    row: Row = {"pair": one.number, "state": one.state.value, "how": one.pair.how, "problem": one.problem}
    row |= {key: None for side in SIDES for key in (side, f"{side}_facts")}
    for side, reading in one.sides.items():
        first = reading.analyses[0]
        row[side] = list(reading.files)
        row[f"{side}_facts"] = {
            "origin": first.recording.origin.value,
            "fs_hz": first.recording.fs_hz,
            "seconds": first.recording.seconds,
            "band_hz": list(first.processed.band_hz),
            "band_why": first.band.why,
            "shaft_from": first.speed.source.value,
            "axial_n": first.recording.axial_n,
            "cautions": list(dict.fromkeys(c for one in reading.analyses for c in one.recording.cautions)),
        }
    row["shaft_hz"] = {side: one.sides[side].shaft_hz if side in one.sides else None for side in SIDES}
    row["compared_in"] = "Hz" if same_speed(*row["shaft_hz"].values()) else "orders"
    return row


def check_pair_sums(rows: Iterable[Row], rolling_elements: int) -> Iterator[Row]:
    """Check for simulated and for measured signals that BPFO and BPFI orders at a speed add to `rolling_elements`."""
    lines = [row for row in rows if row["kind"] == RACE_LINE.kind]
    for place, (side, name) in enumerate(zip(SIDES, ("model", "rig"), strict=True)):
        # A line computed from the cage speed has no reading error; it is no test of the shaft speed.
        read = [row for row in lines if row[f"{name}_present"] and row[f"{name}_ci95"]]
        outers, inners = ([row for row in read if row["state"] == fault] for fault in RACE_DEFECTS)
        for outer in outers:
            shaft_hz = outer["speeds_hz"][place]
            inner = min(inners, key=lambda row: abs(row["speeds_hz"][place] - shaft_hz), default=None)
            if inner is None or abs(inner["speeds_hz"][place] / shaft_hz - 1) > MAX_SUM_SPEED_DIFFERENCE:
                continue
            orders, ci95 = (outer[name], inner[name]), math.hypot(outer[f"{name}_ci95"], inner[f"{name}_ci95"])
            source = f"{side}, {60 * shaft_hz:.5g} rpm"
            yield check_race_sum(source, side, rolling_elements, orders, ci95, 60 * shaft_hz)


def _count_verdicts(rows: pd.DataFrame) -> dict[str, int]:
    counts = rows["verdict"].value_counts()
    return {verdict.value: int(counts[verdict.value]) for verdict in Verdict if verdict.value in counts}
