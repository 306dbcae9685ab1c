"""One verdict from all records of one bearing."""

from collections.abc import Mapping, Sequence
from typing import Any

from srbval.diagnosis import fault_posterior as posterior
from srbval.diagnosis.records import RecordRequest, load_record
from srbval.errors import ConfigurationError, DataError
from srbval.reading.features import read_short
from srbval.reading.pipeline import LEAST_REVOLUTIONS

MIN_POOLED_TURNS = 2.0  # turns of a record that is pooled with others, for its noise to be read between the lines


def machine_of(documents: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Compute one verdict from all records of a bearing; leave out records whose lines contradict the stated speed."""
    if len(names := sorted({document["bearing"] for document in documents})) > 1:
        raise ConfigurationError(
            f"--one-machine: the records are of {len(names)} bearings, {' and '.join(names)}; give records of one "
            "bearing, or state it with --bearing."
        )
    faults = [one["fault"] for one in documents if one["fault"]["log_likelihood"] and not one["shaft_hz"]["outside"]]
    if not faults:
        said = "One machine: no measured record can be used."
        return {"records": 0, "state": None, "called": None, "probabilities": {}, "sentence": said}
    together = posterior.of_one_machine([fault["log_likelihood"] for fault in faults])
    return {"records": len(faults)} | _of_machine(together, f"{len(faults)} records together")


def diagnose_pooled(requests: Sequence[RecordRequest]) -> dict[str, Any]:
    """One verdict from the mean spectrum of a bearing's short records; `DataError` for too few shaft revolutions."""
    found = [read_short(*load_record(request)) for request in requests]
    own = [one.processed.seconds * one.speed.value_hz for one in found]
    if (few := min(own)) < MIN_POOLED_TURNS:
        name = found[own.index(few)].recording.name
        raise DataError(f"{name}: {few:.2g} shaft turns; --one-machine needs {MIN_POOLED_TURNS:g} in each record.")
    if len({one.bearing.name for one in found}) > 1 or len({one.processed.fs_hz for one in found}) > 1:
        raise ConfigurationError(
            "--one-machine: the records differ in bearing or sampling rate; give records that agree in both."
        )
    if (turns := sum(own)) < LEAST_REVOLUTIONS:
        raise DataError(
            f"{len(found)} records have {turns:.3g} turns of the shaft in all; {LEAST_REVOLUTIONS} or more are needed."
        )
    scores = posterior.fault_scores(found[0], found[1:])
    together = posterior.log_likelihood([scores], {}, stands=False)
    how = f"{len(found)} short records, {turns:.0f} turns in all, by their mean spectrum"
    return {"records": len(found)} | _of_machine(together, how)


def _of_machine(together: Mapping[str, float], how: str) -> dict[str, Any]:
    """Verdict on a machine from `together`, one log likelihood ratio per state; `how` is the method in words."""
    shares = posterior.probabilities(together)
    state = posterior.decide(shares)
    parts, best = posterior.faults_of(state), max(shares, key=shares.__getitem__)
    answer = state if state == posterior.UNDECIDED else posterior.LABELS[state]
    answer += " fault" if parts else ", no fault named" if state != posterior.UNDECIDED else ""
    share = f"{posterior.LABELS[best]} {100 * posterior.share_of(best, shares):.0f} %"
    return {
        "state": state,
        "called": parts[0] if parts else None,
        "parts_called": parts,
        "probabilities": shares,
        "log_likelihood": together,
        "sentence": f"One machine: {answer} ({share} by {how}).",
    }
