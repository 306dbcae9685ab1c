"""File formats, recognised by the first bytes of a file, and their loaders; a new format needs a row in `FILE_FORMATS`.

A few damaged bytes can make a C library loop for ever, crash or allocate gigabytes. Loaders therefore run in a child
process with limited computing time and memory. Computing time is limited instead of elapsed time, so that no file is
rejected because the machine is busy. A much longer limit of the elapsed time applies as well, because Windows does not
limit computing time and memory, and macOS does not limit memory.
"""

import atexit
import math
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from srbval.errors import DataError, NoRecordingError
from srbval.processes.worker import DiedError, OverLimitError, WorkerProcess
from srbval.recordings.loaders.arrays import load_json, load_npy, load_npz, load_table
from srbval.recordings.loaders.nested import load_hdf5, load_matlab, load_modelica
from srbval.recordings.loaders.signals import load_audio, load_lvm, load_tdms, load_uff
from srbval.recordings.loaders.text import load_text
from srbval.recordings.raw import TEXT, RawFile

COMPUTING_S = 3.0  # for any file; an intact file of 10 MB needs 0.1 s
BYTES_PER_S = 20e6  # more time for a large file; decompression is ten times faster
WAITING = 12  # limit of the elapsed time divided by the limit of the computing time
EXPANSION = 2  # size of the contents divided by the size of the file: measured noise hardly compresses
WORKSPACE_BYTES = 256 * 2**20  # in addition, for small files that expand more and for chunks during decompression
READER = "srbval.recordings.loaders.reader_process"

# Shared by threads; each access is one atomic operation.
_idle: list[WorkerProcess] = []
_running: set[WorkerProcess] = set()


@dataclass(frozen=True)
class FileFormat:
    """File format: pattern `mark` of a file's first bytes (``.`` is any byte), and the loader `read`.

    Unless `trusted`, `read` may raise anything, hang or crash: it runs in a process with limits. `library` contains the
    module to import before the limits apply, and the name of the package to install. The contents may need
    `expansion` times the size of the file in memory.
    """

    name: str
    description: str
    mark: bytes
    read: Callable[[Path], RawFile]
    library: tuple[str, str] | None = None
    expansion: int = EXPANSION
    trusted: bool = False

    def load(self, path: Path) -> RawFile:
        """Load a file, in a child process unless `trusted`; `DataError` if the loader fails or exceeds a limit."""
        raw = self.read(path) if self.trusted else self._read_in_child(path)
        return raw if raw.format else replace(raw, format=self.name)

    def _read_in_child(self, path: Path) -> RawFile:
        computing_s = math.ceil(COMPUTING_S + path.stat().st_size / BYTES_PER_S)
        folder = None if path.is_absolute() else os.getcwd()
        limit_s, memory = WAITING * computing_s, self.expansion * path.stat().st_size + WORKSPACE_BYTES
        request = (self, path, folder, computing_s, memory)
        try:
            reader, is_new = _idle.pop(), False
        except IndexError:
            reader, is_new = WorkerProcess(READER, may_fork=True), True
        _running.add(reader)
        try:
            try:
                answer: RawFile | DataError = reader.call(request, limit_s=limit_s)
            except DiedError as error:
                if is_new or reader not in _running or isinstance(error, OverLimitError) or "SIGXCPU" in str(error):
                    raise
                answer = reader.call(request, limit_s=limit_s)  # in a new process: the former one has read other files
        except DiedError as error:
            if reader not in _running:
                text = "not read, as the program was interrupted."
            elif isinstance(error, OverLimitError):
                text = f"could not be read within {limit_s} s; its disk may not answer. Try again, or copy it"
            elif "SIGXCPU" in str(error):
                text = f"reading took more than {computing_s} s of computing time. The file is damaged; copy it again"
            else:
                text = f"the process that reads it ended ({error}). Copy the file again; see also: srbval doctor"
            raise DataError(f"{path}: {text}") from None
        except OSError as error:
            raise DataError(f"{path}: cannot start a process to read it ({error.strerror}). Try again.") from None
        except BaseException:
            reader.kill()
            reader.close()
            raise
        finally:
            _running.discard(reader)
        _idle.append(reader)
        if isinstance(answer, DataError):
            raise answer
        return answer


@atexit.register
def end_readers() -> None:
    """End all child processes of this program that read a file or wait for the next one."""
    while _running:
        _running.pop().kill()
    while _idle:
        _idle.pop().close()


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
