"""Sound files, WAV and FLAC, by the library libsndfile."""

import hashlib
import re
from pathlib import Path
from typing import Any

import numpy as np

from srbval.errors import DataError
from srbval.recordings.loaders.limited import Library, limited_format
from srbval.recordings.raw import RawFile, check_claim

EXPANSION = 8  # bits packed without loss or 8-bit samples become 32 or 64-bit ones
BITS = {"PCM_S8": 8, "PCM_U8": 8, "PCM_16": 16, "PCM_24": 24, "PCM_32": 32}
NEVER_WRITTEN = 0xFFFF_FF00  # sizes from here on: of a header that was not completed, as of a stream
FLAC = b"fLaC"
FLAC_MD5 = slice(26, 42)  # of the unpacked samples, in the block STREAMINFO (RFC 9639, section 8.2)
_SIZES = re.compile(r"(\w[\w ]*?)\s*: (\d+) \(should be (\d+)\)")


def load_audio(path: Path) -> RawFile:
    """Read all channels into ``data`` and the sampling rate into ``fs_hz``.

    Whole numbers become shares of full scale, as the format defines them; what full scale is in volt no file says.
    A header that claims more than there is, and a FLAC checksum that does not fit, are a `DataError`.
    """
    import soundfile

    with soundfile.SoundFile(path) as file:
        bits, frames = BITS.get(file.subtype), file.frames
        kind = "float32" if file.subtype == "FLOAT" or (bits and bits <= 24) else "float64"
        check_claim(path, frames * file.channels * np.dtype(kind).itemsize, "its header", EXPANSION)
        cautions = _sizes(path, file.extra_info)
        samples = file.read(dtype=kind, always_2d=True)
        if len(samples) != frames:
            raise DataError(f"{path}: truncated: {len(samples)} of {frames} samples. Copy it again.")
        if file.format == "FLAC" and bits:
            _check_md5(path, file, bits)
        rate = float(file.samplerate)
    note = f"{bits}-bit samples read as shares of full scale; --scale states what that is"
    return RawFile(
        path=path,
        format=FORMAT.name,
        variables={"data": samples[:, 0] if samples.shape[1] == 1 else samples},
        attributes={"fs_hz": rate},
        notes=(note,) if bits else (),
        cautions=cautions,
    )


def _sizes(path: Path, log: str) -> tuple[str, ...]:
    """Refuse a file shorter than its header says; libsndfile reads what there is and only logs it."""
    for name, claimed, there in ((m[1], int(m[2]), int(m[3])) for m in _SIZES.finditer(log)):
        if there < claimed < NEVER_WRITTEN:
            raise DataError(f"{path}: truncated: {name} has {there} of {claimed} bytes. Copy it again.")
        if claimed >= NEVER_WRITTEN or claimed == 0:
            return ("its header was never completed: the record may be cut",)
    return ()


def _check_md5(path: Path, file: Any, bits: int) -> None:
    """Unpack once more, to whole numbers of as many bytes as the samples have, and hash those."""
    with path.open("rb") as stream:
        stated = stream.read(FLAC_MD5.stop)[FLAC_MD5]
    file.seek(0)
    whole = np.ascontiguousarray(file.read(dtype="int32", always_2d=True) >> (32 - bits), "<i4")
    packed = whole.view("u1").reshape(-1, 4)[:, : -(-bits // 8)]
    if any(stated) and hashlib.md5(packed.tobytes(), usedforsecurity=False).digest() != stated:
        raise DataError(f"{path}: damaged: its samples do not have the checksum in its header. Copy it again.")


def _is_audio(head: bytes) -> bool:
    return head.startswith(FLAC) or (head[:4] in (b"RIFF", b"RIFX", b"RF64") and head[8:12] == b"WAVE")


FORMAT = limited_format(
    name="sound",
    description="WAV, FLAC",
    matches=_is_audio,
    load=load_audio,
    library=Library("soundfile", "soundfile", "srbval[formats]"),
    expansion=EXPANSION,
)
