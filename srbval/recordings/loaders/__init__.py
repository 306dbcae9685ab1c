"""File formats, recognised by the first bytes of a file; a new format needs a row in `FILE_FORMATS`."""

import re
from pathlib import Path

from srbval.errors import DataError, NoRecordingError
from srbval.recordings.loaders.arrays import load_json, load_npy, load_npz, load_table
from srbval.recordings.loaders.hdf5 import load_hdf5
from srbval.recordings.loaders.limited import FileFormat
from srbval.recordings.loaders.matlab import load_matlab, load_modelica
from srbval.recordings.loaders.signals import load_audio, load_lvm, load_tdms, load_uff
from srbval.recordings.loaders.text import load_text
from srbval.recordings.raw import TEXT

HEAD_BYTES = 4096
_HDF5 = rb"(?:.{512}|.{1024}|.{2048})?\x89HDF\r\n\x1a\n"  # may follow a user block
_MATLAB = rb"MATLAB 5\.0|.{124}(?:\x00\x01IM|\x01\x00MI)"  # text, or version and order of bytes
_MODELICA = rb".{20}Aclass\0"  # name of the first matrix, behind its header
_SOUND = rb"fLaC|(?:RIFF|RIFX|RF64).{4}WAVE"
_UFF = rb" {4}-1[ \t]*\r?\n {0,5}\d{1,5}b?\s"
_JSON = rb"(?:\xef\xbb\xbf)?\s*(?:\{|\[\s*[-\d\[{])"
_TEXT = rb"\xff\xfe|\xfe\xff|[^\0-\x08\x0b\x0e-\x1f]*\Z"  # UTF-16, or no control characters but white space
_ARROW = rb"PAR1|ARROW1\0\0"
_SCIPY, _PYARROW = ("scipy.io.matlab", "scipy"), ("pyarrow.parquet", "pyarrow")
# Expansion: in memory twice during the transfer; losslessly compressed, or 8 and 16-bit samples become 32 or 64-bit
# samples; texts converted to Python objects first; compressed columns that store repeated values once.
_COPIED, _PACKED, _OBJECTS, _REPEATED = 4, 8, 16, 16

# The first format whose mark matches is used.
FILE_FORMATS = (
    FileFormat("NumPy", "NumPy .npy", rb"\x93NUMPY", load_npy, trusted=True),
    FileFormat("NumPy archive", "NumPy .npz", rb"PK\x03\x04", load_npz),
    FileFormat("HDF5", "HDF5 (MATLAB v7.3 included)", _HDF5, load_hdf5, ("h5py", "h5py")),
    FileFormat("MATLAB v5", "MATLAB v5", _MATLAB, load_matlab, _SCIPY, _COPIED),
    FileFormat("Modelica", "Modelica result", _MODELICA, load_modelica, _SCIPY, _COPIED),
    FileFormat("sound", "WAV, FLAC", _SOUND, load_audio, ("soundfile", "soundfile"), _PACKED),
    FileFormat("TDMS", "TDMS", rb"TDSm", load_tdms, ("nptdms", "npTDMS"), _PACKED),
    FileFormat("UFF58", "universal file (UFF, data set 58)", _UFF, load_uff, ("pyuff", "pyuff"), _OBJECTS),
    FileFormat("LabVIEW", "LabVIEW .lvm", rb"LabVIEW Measurement", load_lvm, ("lvm_read", "lvm-read"), _OBJECTS),
    FileFormat("table in columns", "Parquet, Feather", _ARROW, load_table, _PYARROW, _REPEATED),
    FileFormat("JSON", "JSON", _JSON, load_json, ("pandas", "pandas"), 64),
    FileFormat(TEXT, "a text table", _TEXT, load_text, trusted=True),
)


def detect_format(path: Path) -> FileFormat:
    """Format of a file; `DataError` if the file is missing, empty or of no known format, `OSError` if unreadable."""
    try:
        if path.is_dir():
            raise DataError(f"{path}: is a folder, not a recording; `srbval data add {path}` registers it.")
        if path.exists() and not path.is_file():
            raise DataError(f"{path}: is not a regular file.")
        with path.open("rb") as stream:
            head = stream.read(HEAD_BYTES)
    except FileNotFoundError:
        raise DataError(f"{path}: no such file. Check the path.") from None
    except ValueError as error:
        raise DataError(f"{str(path)!r}: not a usable path ({error}).") from None
    if not head:
        raise DataError(f"{path}: the file is empty (0 bytes). Copy or download it again.")
    for candidate in FILE_FORMATS:
        if re.match(candidate.mark, head, re.DOTALL):
            return candidate
    accepted = ", ".join(candidate.description for candidate in FILE_FORMATS)
    raise NoRecordingError(
        f"{path}: starts with {head[:8]!r}, which is not a known recording format. Accepted: {accepted}."
    )
