"""Loaders for files of measuring systems and sound cards: WAV, FLAC, TDMS, universal files and LabVIEW."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from srbval.errors import DataError
from srbval.recordings.raw import ArrayOrText, RawFile
from srbval.recordings.times import stated_rate
from srbval.recordings.units import is_unit_key

BITS = {"PCM_S8": 8, "PCM_U8": 8, "PCM_16": 16, "PCM_24": 24, "PCM_32": 32}
NEVER_WRITTEN = 0xFFFF_FF00  # least size in a header that was never completed, as in a stream
UFF_FUNCTION, UFF_UNITS = 58, 164  # data sets
UFF_TIME_SIGNALS = (0, 1)  # function types of data set 58: general, time response
UFF_ACCELERATION = 12  # specific data type of its ordinate
UFF_SI_UNITS = 1  # units code of data set 164
UFF_EVEN_TIMES = 1  # abscissa spacing
LVM_TIMES, LVM_FACTS = "X_Value", ("Y_Unit_Label", "Delta_X")  # a column, and rows of a segment's head
_SIZES = re.compile(r"(\w[\w ]*?)\s*: (\d+) \(should be (\d+)\)")
_UFF_MARK = re.compile(rb"^    -1[ \t]*(?:\r?\n|\r|\Z)", re.MULTILINE)
_UFF_END = re.compile(rb"[\r\n]* {4}-1[ \t]*(?:\r?\n|\r|\Z)")  # directly after the bytes of a binary set
# Type, mark of a binary set, number of following lines of text, number of bytes after them.
_UFF_TYPE = re.compile(rb" {0,5}(\d{1,5})(?:(b)\s+\d+\s+\d+\s+(\d+)\s+(\d+)[ \d]*)?")
UFF_HEAD = 4096  # bytes that contain the lines of text of a binary set


def load_audio(path: Path) -> RawFile:
    """Read a sound file: channels as ``data``, rate as ``fs_hz``; integer samples become fractions of full scale."""
    import soundfile

    with soundfile.SoundFile(path) as file:
        bits, frames = BITS.get(file.subtype), file.frames
        kind = "float32" if file.subtype == "FLOAT" or (bits and bits <= 24) else "float64"
        cautions: tuple[str, ...] = ()
        # libsndfile only logs that a file is shorter than its header states
        for name, claimed, there in ((m[1], int(m[2]), int(m[3])) for m in _SIZES.finditer(file.extra_info)):
            if there < claimed < NEVER_WRITTEN and name != "data" and frames:
                cautions = (f"its end is damaged: chunk {name} has {there} of {claimed} bytes; the samples are whole",)
            elif there < claimed < NEVER_WRITTEN:
                raise DataError(f"{path}: truncated: {name} has {there} of {claimed} bytes. Copy it again.")
            if claimed >= NEVER_WRITTEN or claimed == 0:
                cautions = ("its header was never completed: the record may be cut",)
                break
        samples = file.read(dtype=kind, always_2d=True)
        if len(samples) != frames:
            raise DataError(f"{path}: truncated: {len(samples)} of {frames} samples. Copy it again.")
        rate = float(file.samplerate)
    note = f"{bits}-bit samples read as shares of full scale; --scale states what that is"
    return RawFile(
        path=path,
        variables={"data": samples[:, 0] if samples.shape[1] == 1 else samples},
        attributes={"fs_hz": rate},
        notes=(note,) if bits else (),
        full_scale=bool(bits),
        cautions=cautions,
    )


def load_tdms(path: Path) -> RawFile:
    """Read every numeric channel of a TDMS file, scaled by the channel's properties, with its unit and rate.

    Channels are named ``group.channel``, or ``channel`` if there is only one group. If the last segment is cut or was
    not closed, all existing samples are read, with a caution.
    """
    from nptdms import TdmsFile

    with TdmsFile.open(path) as file:
        status = file.file_status
        short = [s for s in (status.channel_statuses or {}).values() if s.read_length < s.expected_length]
        cautions: tuple[str, ...] = ()
        if short:
            held = f"{short[0].read_length} of {short[0].expected_length} samples of a channel"
            cautions = (f"its last segment is cut: {held} are read; copy the file again for the rest",)
        elif status.incomplete_final_segment:
            cautions = ("its last segment was not closed: all existing samples are read",)
        one = len(file.groups()) == 1
        channels = {
            c.name if one else f"{c.group_name}.{c.name}": c
            for group in file.groups()
            for c in group.channels()
            if c.dtype.kind in "fiu" and len(c)
        }
        stated = {name: _plain_properties(c.properties) for name, c in channels.items()}
        shared = [set(properties.items()) for properties in stated.values()]
        common = dict(set.intersection(*shared)) if shared else {}
        facts = _plain_properties(file.properties) | {k: v for k, v in common.items() if not stated_rate(k, v)}
        rates = {name: [r[0] for k, v in p.items() if (r := stated_rate(k, v))] for name, p in stated.items()}
        return RawFile(
            path=path,
            variables={name: c[:] for name, c in channels.items()},
            attributes=facts,
            units={name: str(v) for name, p in stated.items() for k, v in p.items() if is_unit_key(k) and v},
            rates_hz={name: found[0] for name, found in rates.items() if found},
            cautions=cautions,
        )


def _plain_properties(properties: Mapping[str, Any]) -> dict[str, float | str]:
    """Numbers and texts among the properties of a TDMS object."""
    return {k: v for k, v in properties.items() if isinstance(v, int | float | str) and not isinstance(v, bool)}


def load_uff(path: Path) -> RawFile:
    """Read the time signals of a universal file (type 58), named by identification lines, or by nodes if not unique."""
    import pyuff

    file, blocks = pyuff.UFF(str(path)), list(_uff_blocks(path))
    types = [kind for _, _, kind in blocks]
    # pyuff mistakes bytes of samples for marks, so it is given the data sets that the headers define.
    file._block_ind, file._n_sets = np.array(blocks, np.int64).reshape(-1, 3)[:, :2], len(blocks)
    file._set_types, file._set_formats = np.array(types), np.zeros(len(blocks))
    functions = [file.read_sets(i) for i, kind in enumerate(types) if kind == UFF_FUNCTION]
    systems = {int(file.read_sets(i)["units_code"]) for i, kind in enumerate(types) if kind == UFF_UNITS}
    titles = [str(function["id1"]).strip() for function in functions]
    variables: dict[str, ArrayOrText] = {}
    units: dict[str, str] = {}
    rates: dict[str, float] = {}
    for title, function in zip(titles, functions, strict=True):
        if function["func_type"] not in UFF_TIME_SIGNALS:
            continue
        name = title
        if title in ("", "NONE") or titles.count(title) > 1:
            name = f"{len(variables) + 1}: node {function['rsp_node']}, direction {function['rsp_dir']}"
        samples, count = np.asarray(function["data"]), function["num_pts"]
        if samples.size != count:
            raise DataError(f"{path}: truncated: {name!r} has {samples.size} of {count} samples. Copy it again.")
        variables[name] = samples
        label = str(function["ordinate_axis_units_lab"]).strip()
        if label not in ("", "NONE"):
            units[name] = label
        elif function["ordinate_spec_data_type"] == UFF_ACCELERATION and systems == {UFF_SI_UNITS}:
            units[name] = "m/s2"
        if function["abscissa_spacing"] != UFF_EVEN_TIMES:
            variables[f"{name}.time"] = np.asarray(function["x"])
        elif function["abscissa_inc"] > 0:
            rates[name] = 1 / float(function["abscissa_inc"])
    return RawFile(path=path, variables=variables, units=units, rates_hz=rates)


def _uff_blocks(path: Path) -> Iterator[tuple[int, int, int]]:
    """Yield first byte, last byte and type of each data set in a universal file; `DataError` if one does not end."""
    content, at = path.read_bytes(), 0
    while (mark := _UFF_MARK.search(content, at)) is not None:
        head = _UFF_TYPE.match(content, mark.end())
        if head is None:
            at = mark.end()
            continue
        end = _UFF_MARK.search(content, head.end())
        stop = end.start() if end else len(content)
        if head[2] and (size := int(head[4] or 0)):
            lines = content[head.end() : head.end() + UFF_HEAD].splitlines(keepends=True)
            begin = head.end() + sum(map(len, lines[: int(head[3]) + 1]))
            stop, end = begin + size, _UFF_END.match(content, begin + size)
        if end is None or stop > len(content):
            raise DataError(f"{path}: truncated: its last data set does not end. Copy it again.")
        yield mark.start(), stop - 1, int(head[1])
        at = end.end()


def load_lvm(path: Path) -> RawFile:
    """Read the channels of a LabVIEW measurement file (.lvm) with their units, rates and times."""
    import lvm_read

    lines = path.read_text("utf-8-sig", "replace").splitlines(keepends=True)
    contents = lvm_read.read_lines(lines, separator=lvm_read._get_separator(lines))
    variables: dict[str, ArrayOrText] = {}
    units: dict[str, str] = {}
    rates: dict[str, float] = {}
    for number in range(contents["Segments"]):
        segment, channel = contents[number], 0
        for name, column in zip(segment["Channel names"], segment["data"].T, strict=False):
            if name in ("Comment", ""):
                continue
            key = f"{name} (segment {number + 1})" if number else name
            key = key if key not in variables else f"{key} ({len(variables) + 1})"
            there = np.flatnonzero(~np.isnan(column))
            variables[key] = column[: there[-1] + 1 if there.size else 0]
            if name == LVM_TIMES:
                units[key] = "s"
                continue
            facts = {what: values[channel] for what in LVM_FACTS if len(values := segment.get(what, ())) > channel}
            units |= {key: facts[LVM_FACTS[0]]} if facts.get(LVM_FACTS[0]) else {}
            rates |= {key: stated[0]} if (stated := stated_rate("dt", facts.get(LVM_FACTS[1], 0.0))) else {}
            channel += 1
    return RawFile(path=path, variables=variables, units=units, rates_hz=rates)
