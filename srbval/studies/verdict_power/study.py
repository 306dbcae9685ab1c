"""How often do the verdicts on the cage ratio say met, missed and not resolved? Simulated rigs whose truth is known.

A rig has the records that are registered, with the uncertainties of their readings and speeds. Its true ratios are
those of the scene ``rig`` at one of the draws of its inputs, which the verdict does not know, times a planted error of
one endpoint: in every record, in those of the slowest speed, or in those of the outer race. Records scatter about them
by `BETWEEN_PCT`. What is read goes through the report's own functions: `cage_means`, then `verdict`. Not simulated: the
records' samples and how a line is read in them.
"""

from argparse import Namespace
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from statistics import NormalDist
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import DEFAULT_BEARING, load_bearing
from srbval.comparison.budget import STATED, TOLERANCE, Answer
from srbval.comparison.cage_means import cage_means, covariance
from srbval.comparison.cage_readings import CageReading, cage_readings
from srbval.comparison.verdicts import Endpoint, endpoints, of_model, verdict
from srbval.errors import DataError
from srbval.progress import Progress, silent
from srbval.progress.tables import text_rows
from srbval.recordings.registry import load_entry, rig_recordings
from srbval.storage.stored_result import newest_result
from srbval.studies.harness import StudyResult, input_hashes

RIGS, SEED = 1000, 36
PLANTED_PCT = (0.0, 0.05, 0.1, 0.2)
BETWEEN_PCT = 0.05  # standard deviation between records of one speed


def true_ratios(variant: Mapping[str, Any], readings: Sequence[CageReading]) -> FloatArray:
    """Of the variant at its draws, for every reading, [records, draws]."""
    drawn = np.array([one["drawn"] for one in variant["records"]])
    return np.array([of_model(variant, [one], np.ones(1)) @ drawn for one in readings])


def rates(
    variant: Mapping[str, Any], readings: Sequence[CageReading], *, rigs: int, progress: Progress = silent
) -> Iterator[dict[str, Any]]:
    """A row for every endpoint and planted error: the shares of `rigs` rigs with each answer."""
    known, truth = list(endpoints(readings, cage_means(readings))), true_ratios(variant, readings)
    cells = [(number, one, pct) for number, one in enumerate(known) for pct in PLANTED_PCT]
    for done, (number, endpoint, planted_pct) in enumerate(cells):
        rng, found = np.random.default_rng([SEED, number]), Counter[Answer]()
        for rig in range(rigs):
            progress("Simulate rigs", (done + rig / rigs) / len(cells))
            planted = 1 + planted_pct / 100 * rng.choice([-1, 1]) * (endpoint.weights > 0)
            ratios = truth[:, rng.integers(truth.shape[1])] * planted
            read = read_again(readings, ratios, rng)
            means = cage_means(read)
            found[verdict(list(endpoints(read, means))[number], variant, read, means.means[-1]).verdict] += 1
        shares = {one.value.replace(" ", "_"): found[one] / rigs for one in Answer}
        most = attainable(endpoint, truth, readings, planted_pct)
        yield {"endpoint": endpoint.name, "planted_pct": planted_pct, **shares, "attainable": most, "rigs": rigs}
    progress("Simulate rigs", 1.0)


def attainable(of: Endpoint, truth: FloatArray, readings: Sequence[CageReading], planted_pct: float) -> float | None:
    """How often "missed" could be found at most, with the scatter between records known; None up to the limit.

    With errors normal, Phi((planted - limit) / s - z) of the one-sided test of level risk, z = Phi^-1(1 - risk): s is
    that of the records' readings, speeds and scatter, and of the `truth` [records, draws] over the model's inputs.
    """
    if planted_pct <= TOLERANCE.limit_pct:
        return None
    scale, normal = float(truth.mean()), NormalDist()
    own = covariance(readings) + (BETWEEN_PCT / 100 * scale) ** 2 * np.eye(len(readings))
    s_pct = 100 / scale * float(np.sqrt(of.weights @ own @ of.weights + np.var(of.weights @ truth)))
    return normal.cdf((planted_pct - TOLERANCE.limit_pct) / s_pct - normal.inv_cdf(1 - TOLERANCE.risk))


def read_again(
    readings: Sequence[CageReading], ratios: FloatArray, rng: np.random.Generator, between_pct: float = BETWEEN_PCT
) -> list[CageReading]:
    """The readings of records with these true ratios, which scatter by `between_pct` besides."""
    scattered = ratios * (1 + between_pct / 100 * rng.standard_normal(ratios.size))
    read = scattered + rng.multivariate_normal(np.zeros(ratios.size), covariance(readings))
    return [replace(one, ratio=ratio) for one, ratio in zip(readings, read.tolist(), strict=True)]


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    stored, bearing = newest_result("cage_draws"), load_bearing(DEFAULT_BEARING)
    if stored is None:
        raise DataError("no stored draws of the model's cage ratio; srbval study run cage_draws makes them.")
    variant = next(v for v in stored.content["variants"] if (v["scene"], v["form"]) == ("rig", STATED))
    entries = rig_recordings()
    readings = cage_readings([load_entry(one) for one in entries], bearing)
    rows = list(rates(variant, readings, rigs=options.rigs or RIGS, progress=progress))
    return StudyResult(
        name="verdict_power" if options.rigs in (None, RIGS) else None, text=text_rows(rows),
        content={"between_pct": BETWEEN_PCT, "records": [one.record for one in readings], "rows": rows},
        inputs=input_hashes(stored, *entries),
    )  # fmt: skip
