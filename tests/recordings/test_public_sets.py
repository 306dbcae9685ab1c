"""Public data sets of the package `bearing-datasets` become recordings."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import srbval

NOISE = np.random.default_rng(5).normal(size=(3, 4096)).astype("float32")
ORDERS = {"bpfo": 3.5848, "bpfi": 5.4152, "bsf": 2.35675, "ftf": 0.39828}
COMMON = {"recording_id": "IR_1", "native_label": "IR", "fs": 12000.0, "fault_type": "inner", "speed_rpm": 1797.0}
COMMON |= {"fault_location": "motor_bearing_de", "quantity": "acceleration", "unit": "g", "bearing_model": "6205-2RS"}
COMMON |= {"dataset": "mine", "sensitivity": "none", "speed_profile": "varying", **ORDERS}
NEAR, FAR = ({"sensor_location": f"motor_bearing_{end}", "sensor_at_fault": end == "de"} for end in ("de", "nde"))
TURNS = {"recording_id": "N_1", "native_label": "N", "fault_type": "normal", "fault_location": "none"}
ROWS = [
    {"channel": "DE", **NEAR},
    {"channel": "FE", **FAR, "unit": "V", "bearing_model": "unknown"},
    {"channel": "DE", **NEAR, **TURNS, "sensor_at_fault": False},
    {"channel": "speed", **FAR, **TURNS, "quantity": "speed", "unit": "rpm", "fs": 100.0},
]
SAMPLES = [*NOISE, 1790 + np.tile([1.0, -1.0], 20)]
TABLE = pd.DataFrame([COMMON | row for row in ROWS])
TABLE["signal_id"], TABLE["n_samples"] = TABLE["recording_id"] + "/" + TABLE["channel"], [len(x) for x in SAMPLES]


def built(root: Path) -> Any:
    """Build a data set that the package itself writes, checks and opens."""
    package = pytest.importorskip("bearing_datasets")
    from bearing_datasets.build import SignalWriter
    from bearing_datasets.schema import validate

    writer = SignalWriter(root / "mine" / "signals")
    for identity, samples in zip(TABLE["signal_id"], SAMPLES, strict=True):
        writer.add(identity, samples)
    writer.close()
    places = pd.DataFrame(writer.locations, index=["signal_file", "signal_row_group", "signal_row"]).T
    table = TABLE.join(places, on="signal_id").astype({"signal_row_group": int, "signal_row": int})
    validate(table)
    table.to_parquet(root / "mine" / "metadata.parquet")
    (root / "mine" / "manifest.json").write_text(json.dumps({"dataset": "mine", "schema_version": 2}))
    return package.open("mine", root)


def test_facts_of_a_set_are_those_of_the_recordings(tmp_path: Path) -> None:
    """Statements of the set are used, missing ones are open questions, and the user's statements replace them."""
    dataset = built(tmp_path)
    first, far, healthy = srbval.dataset_recordings(dataset, unit="g")
    np.testing.assert_allclose(first.channels["DE"], 9.80665 * NOISE[0], rtol=1e-6)
    np.testing.assert_allclose(far.channels["FE"], 9.80665 * NOISE[1], rtol=1e-6)
    assert [one.state for one in (first, far, healthy)] == ["inner", None, "healthy"]
    assert (first.fs_hz, first.unit, first.own_bearing.orders.bpfi) == (12000.0, "m/s2", ORDERS["bpfi"])
    assert (first.speed.source, round(60 * first.speed.ci95_hz)) == ("nominal", round(0.015 * 1797))
    assert "speed varying, and its course" in first.cautions[-1]
    assert (healthy.speed.source, round(60 * healthy.speed.value_hz)) == ("tachometer", 1790)
    assert "the fault, inner, is at motor_bearing_de, not at this sensor's motor_bearing_nde" in far.notes
    with pytest.raises(srbval.DataError, match=r"FE lacks information: no unit: unit=m/s2 "):
        srbval.dataset_recordings(dataset)
    rows = dataset.metadata().query("channel == 'DE'").drop(columns=[*ORDERS, "speed_rpm", "bearing_model"])
    (one, _) = srbval.dataset_recordings(dataset, rows, state="outer")
    assert (one.state, one.speed, one.own_bearing) == ("outer", None, None)
    with pytest.raises(srbval.ConfigurationError, match=r"no bearing.*no shaft speed"):
        srbval.read_record(srbval.RecordRequest(recording=one))
    (stated, _) = srbval.dataset_recordings(dataset, rows, rpm=1750, bearing="skf-6205")
    assert (stated.speed.source, stated.bearing) == ("stated", "skf-6205")
