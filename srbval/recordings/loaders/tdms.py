"""TDMS files of LabVIEW and its relatives, by the library npTDMS."""

from pathlib import Path
from typing import Any

from srbval.errors import DataError
from srbval.recordings.loaders.limited import Library, limited_format
from srbval.recordings.raw import RawFile, Value, check_claim

EXPANSION = 8  # 8 and 16-bit samples with a scaling become 64-bit ones
MAX_CHANNELS = 256
UNITS = ("unit_string", "NI_UnitDescription")  # properties of a channel that name its unit
INCREMENT = "wf_increment"  # and its time step [s]


def load_tdms(path: Path) -> RawFile:
    """Read every numeric channel, scaled as its properties say, with its unit and rate.

    Channels are named ``group.channel``, or ``channel`` where there is one group. Other properties of the file, its
    groups and channels that are numbers or texts become attributes.
    """
    from nptdms import TdmsFile

    with TdmsFile.open(path) as file:
        _check_whole(path, file)
        channels = {_name(c, len(file.groups())): c for group in file.groups() for c in group.channels()}
        numeric = {name: c for name, c in channels.items() if c.dtype.kind in "fiu" and len(c)}
        if len(numeric) > MAX_CHANNELS:
            raise DataError(f"{path}: {len(numeric)} channels; {MAX_CHANNELS} are read at most.")
        check_claim(path, sum(c.dtype.itemsize * len(c) for c in numeric.values()), "its channels", EXPANSION)
        variables: dict[str, Value] = {name: c[:] for name, c in numeric.items()}
        steps = {name: c.properties.get(INCREMENT) for name, c in numeric.items()}
        attributes = {k: v for k, v in file.properties.items() if isinstance(v, int | float | str)}
        units = {name: str(c.properties[u]) for name, c in numeric.items() for u in UNITS if u in c.properties}
    rates = {name: 1 / step for name, step in steps.items() if isinstance(step, float) and step > 0}
    return RawFile(
        path=path, format=FORMAT.name, variables=variables, attributes=attributes, units=units, rates_hz=rates
    )


def _check_whole(path: Path, file: Any) -> None:
    """Refuse a last segment that is shorter than its header says."""
    status = file.file_status
    short = [s for s in (status.channel_statuses or {}).values() if s.read_length < s.expected_length]
    if short or status.incomplete_final_segment:
        held = f", {short[0].read_length} of {short[0].expected_length} samples of a channel" if short else ""
        raise DataError(f"{path}: truncated: its last segment is not whole{held}. Copy it again.")


def _name(channel: Any, groups: int) -> str:
    return channel.name if groups == 1 else f"{channel.group_name}.{channel.name}"


FORMAT = limited_format(
    name="TDMS",
    description="TDMS",
    matches=lambda head: head.startswith(b"TDSm"),
    load=load_tdms,
    library=Library("nptdms", "npTDMS", "srbval[formats]"),
    expansion=EXPANSION,
)
