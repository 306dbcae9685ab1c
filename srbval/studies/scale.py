"""Cost of commands against the size of their input; each runs in a separate process, one after the other.

A row of the result contains the wall time, CPU time, memory of the largest process and written bytes of a command,
including its start. The cost per further unit is the cost difference from the previous size divided by the size
difference, so the start cancels. If it increases with size, cost grows faster than linearly.
"""

import os
import subprocess
import sys
import tempfile
import time
from itertools import groupby
from pathlib import Path

import numpy as np
import pandas as pd

from srbval.bearing import DEFAULT_BEARING
from srbval.bearing.catalogue import FOLDER
from srbval.comparison.comparison import Row
from srbval.errors import ConfigurationError, NumericsError
from srbval.processes.machine import load_average, usable_cores
from srbval.progress import Progress, silent
from srbval.progress.tables import text_rows
from srbval.storage.installation import child_environment, git_revision
from srbval.storage.tables import read_toml
from srbval.studies.harness import StudyResult, result_origin
from srbval.sweep.sweep import records

FS_HZ, IMPACTS_HZ, BLOCK_S = 20480, 97.0, 2.0  # of the records: repeated blocks of impacts in noise
TABLE = read_toml(Path(__file__).with_name("scale.toml"))
BEARING = (FOLDER / "known" / f"{DEFAULT_BEARING}.toml").read_text("utf-8")
FILES = TABLE["files"] | {"bearing.toml": BEARING.replace("rollers_per_row = 19", "rollers_per_row = SIZE")}
COMPILING = "simulate --defect outer --fresh -o run.h5 --seconds 0.02"  # run before all others
JOBS = tuple(2**k for k in range(usable_cores().bit_length() + 1))  # 1, 2, 4, ... until more processes than cores
# A process's memory includes the process from which it was forked, so a small process starts the command.
ALONE = """import os, sys
said = [(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)]
_, status, used = os.wait4(os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ, file_actions=said), 0)
print(used.ru_utime + used.ru_stime, used.ru_maxrss)
sys.exit(os.waitstatus_to_exitcode(status) % 256)
"""
COST_COLUMNS = {"size": "size", "wall [s]": "wall_s", "CPU [s]": "cpu_s", "CPU per further unit [s]": "cpu_per_unit_s"}
COST_COLUMNS |= {"largest process [MB]": "memory_mb", "written [MB]": "written_mb"}


def measure_scale(*, quick: bool = False, progress: Progress = silent) -> StudyResult:
    """Measure the cost of commands for growing inputs and more processes; if `quick`, for the smallest only."""
    if not hasattr(os, "wait4"):
        raise ConfigurationError("bench --scale runs on Linux and macOS only: other systems do not report memory.")
    sizes = {name: about.get("sizes", JOBS)[: 1 if quick else None] for name, about in TABLE["series"].items()}
    wanted = [(name, size) for name, of_series in sizes.items() for size in of_series]
    rows, load = list[Row](), load_average()
    with tempfile.TemporaryDirectory(prefix="srbval-scale-") as folder:
        _measure_command(COMPILING, Path(folder))
        for series, size in wanted:
            progress("cost against size", len(rows) / len(wanted))
            command = TABLE["series"][series]["command"].replace("SIZE", str(size))
            _write_inputs(Path(folder), command.split()[1], size)
            rows.append({"series": series, "size": size} | _measure_command(command, Path(folder)))
    steps = pd.DataFrame(rows).groupby("series")[["cpu_s", "size"]].diff()
    rows = records(pd.DataFrame(rows).assign(cpu_per_unit_s=steps["cpu_s"] / steps["size"]))
    content = result_origin("scale", "srbval bench --scale", git_revision()) | {"rows": rows}
    content |= {"computed_once": "times on one machine", "machine": content["machine"] | {"load_before": load}}
    text = _text(content)
    return StudyResult(content=content | {"text": text}, text=text)


def _text(content: Row) -> str:
    """Text of a result: a cost table for each series of commands; machine, time and revision."""
    series = groupby(content["rows"], key=lambda row: str(row["series"]))
    origin = "{processor}, {usable_cores} cores, load before {load_before:.2g}".format(**content["machine"])
    tables = (f"{name[0].upper()}{name[1:]}\n{text_rows(list(rows), COST_COLUMNS)}" for name, rows in series)
    return "\n\n".join((*tables, f"{origin}; {content['made_utc']}, revision {content['git_revision']}"))


def _write_inputs(folder: Path, name: str, size: float) -> None:
    """Write a command's input files; at `name` a record of `size` minutes, or a folder of `size` records, if needed."""
    for file, text in FILES.items():
        (folder / file).write_text(text.replace("SIZE", str(size)), "utf-8")
    if name.startswith("record"):
        _write_record(folder / name, 60 * size)
    elif name.startswith("files"):
        (folder / name).mkdir()
        for number in range(int(size)):
            _write_record(folder / name / f"{number}.npy", BLOCK_S)


def _write_record(path: Path, seconds: float) -> None:
    since = np.arange(round(BLOCK_S * FS_HZ)) / FS_HZ % (1 / IMPACTS_HZ)
    block = np.random.default_rng(1).normal(0, 0.3, since.size) + np.exp(-900 * since) * np.sin(12_000 * since)
    np.save(path, np.resize(block.astype(np.float32), round(seconds * FS_HZ)))


def _measure_command(command: str, folder: Path) -> Row:
    """Run one command in `folder` and measure its cost."""
    began, started = time.time(), time.perf_counter()
    words = [sys.executable, "-c", ALONE, sys.executable, "-m", "srbval", *command.split(), "--json"]
    done = subprocess.run(words, cwd=folder, env=os.environ | child_environment(), capture_output=True, text=True)
    if done.returncode:
        raise NumericsError(f"srbval {command} failed: {done.stderr[-400:]}")
    cpu_s, kilobytes = map(float, done.stdout.split())
    row = {"wall_s": time.perf_counter() - started, "cpu_s": cpu_s, "memory_mb": kilobytes / 1024}
    about = (path.stat() for path in folder.rglob("*"))
    return row | {"written_mb": sum(one.st_size for one in about if one.st_mtime > began) / 1e6}
