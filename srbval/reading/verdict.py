"""The verdict on one record: a sentence that says which lines were found, and nothing more."""

from srbval.bearing import Fault
from srbval.reading.lines import Line, detected_fault_lines
from srbval.recordings import Origin, Recording, ShaftSpeed, SpeedSource

# A defect that is struck once a period modulates the squared envelope by about its mean and more. Lines below
# this share occur in healthy bearings and as by-lines of other faults.
SHALLOW_DEPTH = 0.5


def verdict(lines: tuple[Line, ...], recording: Recording, speed: ShaftSpeed) -> str:
    """Which race or roller line was detected, how clearly, and what that does not mean, in plain sentences.

    A detected line is not yet a fault: the passing of rollers under load gives a healthy bearing a BPFO line
    of its own, so a line counts against the healthy bearing at the same speed and load. A stand-in
    never earns a verdict, a simulated run is named as one.
    """
    if recording.origin is Origin.STAND_IN:
        return "No verdict: this file is a synthetic stand-in, not a measurement."
    parts = [line for line in lines if Fault.of_line(line.name) and line.harmonic == 1]
    detected = detected_fault_lines(lines)
    sentences = [_found(detected, speed) if detected else _nothing(parts)]
    if detected:
        sentences.append(_caution(detected, recording))
    if recording.origin is Origin.SIMULATED:
        sentences.append("The record is simulated.")
    return " ".join(sentences)


def _found(detected: list[Line], speed: ShaftSpeed) -> str:
    first, *others = detected
    text = f"{_name(first)} line detected: {_numbers(first)}"
    if speed.source is SpeedSource.NOMINAL:
        text += " (the speed is only nominal)"
    weaker = ", ".join(f"{_name(line)}, {_numbers(line)}" for line in others)
    return text + (f"; weaker: {weaker}" if others else "") + "."


def _name(line: Line) -> str:
    fault = Fault.of_line(line.name)
    return line.name if fault is None else f"{line.name} ({fault.label})"


def _numbers(line: Line) -> str:
    return (
        f"{line.found_hz:.2f} ± {line.ci95_hz:.2g} Hz, {line.snr:,.0f} times the noise, "
        f"modulation {100 * (line.depth or 0.0):.0f} %, "
        f"{line.deviation_pct:+.2f} % from kinematic"
    )


def _nothing(parts: list[Line]) -> str:
    unread = [line.name for line in parts if line.found_hz is None]
    hidden = f" ({', '.join(unread)} out of reach or hidden by the shaft's harmonics)" if unread else ""
    return f"No race or rolling-element line detected{hidden}; a fault without a visible line is not excluded."


def _caution(detected: list[Line], recording: Recording) -> str:
    if recording.state is Fault.HEALTHY:
        return (
            "The recording is declared healthy: the line is its baseline, not a fault (rollers passing under "
            "load give one)."
        )
    is_shallow = (detected[0].depth or 0.0) < SHALLOW_DEPTH
    shallow = "Healthy bearings show a modulation this shallow too. " if is_shallow else ""
    if detected[0].name == "BPFO":
        return (
            f"{shallow}A BPFO line alone is not a fault verdict: rollers passing under load give a healthy "
            "bearing one too; compare with a healthy record at the same speed and load."
        )
    return (
        f"{shallow}A line is evidence, not yet a fault verdict: compare with a healthy record at the same "
        "speed and load."
    )
