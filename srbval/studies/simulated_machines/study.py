"""Simulated machines: what a fault adds, by the impulse model behind a path, to a measured background that is healthy.

What is drawn for each is in ``machines.toml``. The background is a part of a healthy record, all of it as many times as
fast as drawn; a fault at its shaft's speed is added at the level drawn, and the sum is scored as any record is
(`fault_scores`), also as what it is not (`readings`). No record of a faulty bearing is opened. A machine takes a tenth
or two of a second of computing: the model's ring and path are linear filters of the forces of passages, and neither
lines are read nor the speed searched for, which is the background's, as well known as there.
"""

import dataclasses
import math
from argparse import Namespace
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing, ElementShape, Fault, known_bearings, load_bearing
from srbval.errors import DataError, SrbvalError
from srbval.models.planar.contacts import HIGHEST_SHARE, element_slot
from srbval.models.simulate import Step, simulate
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.pipeline import process
from srbval.recordings import Origin, Recording, SpeedSource
from srbval.recordings.registry import listing
from srbval.scene import Scene, paper_scene
from srbval.signal import NORMAL_95
from srbval.studies.harness import StudyResult, input_hashes
from srbval.studies.known_records import KnownFeatures, KnownRecord, features_of, known_records, readings, specimen
from srbval.studies.open_inputs import drawn, open_inputs

Rng = np.random.Generator
MACHINES = 3000
MACHINE = "machine."
INPUTS = {one.keys[0]: one for one in open_inputs(Path(__file__).with_name("machines.toml"))}
OF_SCENE = tuple(one for key, one in INPUTS.items() if not key.startswith(MACHINE))
OWN, BALL = "own", "ball"
LOWEST_THIRD, HIGHEST_OF_RATE = 20, 0.4  # of the path's bands: 10^(20 / 10) Hz, and the share of the sampling rate
HEIGHT_M = -5e-4  # deeper than an element sinks into an opening of these lengths


def machine_features(backgrounds: Sequence[KnownRecord], seed: int, number: int) -> list[KnownFeatures]:
    """Features of machine `number` as what it is, and of a faulty one as one of the things that it is not.

    `backgrounds` are healthy; every rig is as probable, every bearing of a rig, and every record of a bearing. Empty
    where the model refuses the scene.
    """
    random = np.random.default_rng([seed, number])
    value = {
        key.removeprefix(MACHINE): one.value(random.random()) for key, one in INPUTS.items() if one not in OF_SCENE
    }
    record = _one_of(backgrounds, random)
    whole = _read(record)
    recording = part_of(whole, float(value["stretch"]), float(value["turns"]), random)
    bearing = whole.bearing if value["bearing"] == OWN else _any_bearing(value["bearing"] == BALL, random)
    state = Fault(str(value["state"]))
    try:
        if state is not Fault.HEALTHY:
            added = fault_signal(recording, bearing, state, value, random)
            recording = with_added(recording, added, float(value["level_db"]))
    except SrbvalError:
        return []
    speed, band_hz = recording.speed, recording.band_hz
    assert speed is not None, "see part_of"
    assert band_hz is not None, "see part_of"
    processed = process(recording, band_hz=band_hz)
    read = dataclasses.replace(whole, recording=recording, bearing=bearing, speed=speed, processed=processed)
    own, *wrong = readings(state, read)
    one = [wrong[number % len(wrong)]] if wrong else []
    return [features_of(record, *reading) for reading in (own, *one)]


def part_of(whole: Analysis, stretch: float, turns: float, random: Rng) -> Recording:
    """Some `turns` of a healthy record, no more than it has, `stretch` times as fast, its speed as it was found."""
    recording, speed = whole.recording, whole.speed
    count = min(recording.samples, round(turns / speed.value_hz * recording.fs_hz))
    first = int(random.integers(0, recording.samples - count + 1))
    band = whole.processed.band_hz
    return dataclasses.replace(
        recording, origin=Origin.SIMULATED, fs_hz=stretch * recording.fs_hz, speed_signal=None,
        channels={recording.channel or "": recording.channels[recording.channel or ""][first : first + count]},
        band_hz=(stretch * band[0], stretch * band[1]), speed=dataclasses.replace(
            speed, value_hz=stretch * speed.value_hz, ci95_hz=stretch * speed.ci95_hz, drift_hz=None, spread_hz=None
        ),
    )  # fmt: skip


def fault_signal(
    recording: Recording, bearing: Bearing, state: Fault, value: Mapping[str, float | str], random: Rng
) -> FloatArray:
    """What a sensor shows of a fault at the shaft's speed, [n] as sampled in `recording`; raises what the model raises.

    Zero for a ball's defect that does not meet the races. Where the background shows no speed but its set point the
    true one is anywhere in the interval of that, else off by as much as its interval says.
    """
    speed = recording.speed
    assert speed is not None, "see part_of"
    nominal = speed.source is SpeedSource.NOMINAL
    off_hz = speed.ci95_hz * (random.uniform(-1, 1) if nominal else random.standard_normal() / NORMAL_95)
    scene = paper_scene(
        bearing=bearing.name, model="impulse", shaft_speed_rad_s=2 * math.pi * (speed.value_hz + off_hz),
        duration_s=recording.seconds, output_rate_hz=recording.fs_hz, solver={"step_s": 1 / recording.fs_hz},
        defect={"kind": state, "shape": "hole", "height_m": HEIGHT_M,
                "extent_m": float(value["extent"]) * (bearing.pitch_diameter_m or 0.04)},
        sensor_path=path_of(recording.fs_hz, random), seed=int(random.integers(2**31)),
    )  # fmt: skip
    scene, _ = drawn(OF_SCENE, scene, [random.random() for _ in OF_SCENE])
    if not meets_races(scene, bearing, float(value["place"])):
        return np.zeros(recording.samples)
    return simulate(scene, step=Step.UNCHECKED).sensor_m_s2[: recording.samples]


def path_of(fs_hz: float, random: Rng) -> dict[str, object]:
    """The table of a path whose third octaves have a gain each, along the load and across it."""
    count = 1 + math.floor(10 * math.log10(HIGHEST_OF_RATE * fs_hz)) - LOWEST_THIRD
    gains = [
        [10 ** (float(INPUTS[f"{MACHINE}gain_db"].value(random.random())) / 20) for _ in range(count)] for _ in range(2)
    ]
    middles = [10 ** ((LOWEST_THIRD + number) / 10) for number in range(count)]
    return {"frequency_hz": middles, "load": gains[0], "cross": gains[1], "source": "drawn"}


def meets_races(scene: Scene, bearing: Bearing, place: float) -> bool:
    """Does a defect on a rolling element meet the races?

    A ball rolls about an axis that stays for a while, along one great circle: a defect at a share `place` of the radius
    from its plane meets a race if that is within half its length and half the width of the most loaded contact. Evenly
    distributed over the sphere `place` is uniform (Archimedes). A roller's defect is on what rolls.
    """
    elements = bearing.elements
    if scene.defect.kind is not Fault.ROLLER or elements is None or elements.shape is not ElementShape.BALL:
        return True
    slot = element_slot(scene, elements)
    depth_m = slot.deepest_m(HIGHEST_SHARE[elements.shape] * scene.load.radial_n / elements.rolling_elements) / 2
    half_m = math.sqrt(2 * depth_m / slot.races[0].fall_1_m) + (scene.defect.extent_m or 0.0) / 2
    return place * elements.element_diameter_m / 2 <= half_m


def with_added(recording: Recording, added: FloatArray, level_db: float) -> Recording:
    """The record and `added` [n], whose RMS is brought to `level_db` over the record's; silence stays silence."""
    name = recording.channel or ""
    background = recording.channels[name]
    rms = float(np.std(added))
    scale = 10 ** (level_db / 20) * float(np.std(background)) / rms if rms > 0 else 0.0
    return dataclasses.replace(recording, channels={name: background + scale * added})


def _one_of(records: Sequence[KnownRecord], random: Rng) -> KnownRecord:
    for key in (lambda r: r.rig, specimen, lambda r: (r.entry.file, r.entry.channel)):
        groups = list(dict.fromkeys(map(key, records)))
        chosen = groups[int(random.integers(len(groups)))]
        records = [record for record in records if key(record) == chosen]
    return records[0]


def _any_bearing(ball: bool, random: Rng) -> Bearing:
    names = _bearings_of(ball)
    return load_bearing(names[int(random.integers(len(names)))])


@cache
def _bearings_of(ball: bool) -> tuple[str, ...]:
    every = map(load_bearing, known_bearings())
    return tuple(b.name for b in every if (b.elements is not None and b.elements.shape is ElementShape.BALL) == ball)


@cache
def _read(record: KnownRecord) -> Analysis:
    recording, bearing = record.load()
    return analyse(recording, bearing=bearing)


def run(options: Namespace, progress: Progress) -> StudyResult:
    """A row for each reading: its machine's number, rig and bearing of the background, state, features."""
    count, seed = options.machines or MACHINES, 1 if options.seed is None else options.seed
    backgrounds = [one for one in known_records(listing().recordings) if one.state is Fault.HEALTHY]
    if not backgrounds:
        raise DataError("no measured record of a healthy bearing is registered: srbval data add DIR --state healthy.")
    rows: list[list[Any]] = []
    with ProcessPoolExecutor(options.jobs) as pool:
        every = pool.map(partial(machine_features, backgrounds, seed), range(count), chunksize=20)
        for number, machine in enumerate(every):
            progress("simulate the machines", number / count)
            rows += [[number, one.rig, one.specimen, one.state, *one.features] for one in machine]
    progress("simulate the machines", 1.0)
    text = text_rows([{"machines": count, "of them not refused": len({row[0] for row in rows})}])
    content = {"seed": seed, "machines": count, "features": rows}
    inputs = input_hashes(*(record.entry for record in backgrounds))
    return StudyResult(name="simulated_machines", content=content, text=text, inputs=inputs)
