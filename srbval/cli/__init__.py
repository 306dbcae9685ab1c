"""Command line, `srbval COMMAND`: parses the arguments, runs the command and converts errors to exit codes."""

import contextlib
import importlib
import os
import select
import signal
import sys
import tempfile
import threading
import traceback
from collections.abc import Iterator, Sequence
from typing import Any

from srbval.errors import ConfigurationError, DataError, SrbvalError

SIGNALLED = 128  # plus the signal number: exit code of an interrupted command, as in shells
INTERNAL = 70  # exit code of an error in srbval itself: EX_SOFTWARE in sysexits.h
ENDING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
RESUMED = ("bench", "campaign", "evidence", "features", "report", "stability", "study")  # can be continued
# Numerical libraries start one thread per core for small products, which then wait for each other: up to 30 times the
# work.
LIBRARY_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


class Interrupted(KeyboardInterrupt):
    """Exception for a signal such as Ctrl-C; after a plain `KeyboardInterrupt` Python may replace the exit code."""


def run_command_line(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Exit codes: 0 success, 1 out of tolerance or outdated, 2 wrong use, 3 bad data, 4 failed or inaccurate simulation,
    70 internal error, 128 + n ended by signal n.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    as_json = any(len(word) > 2 and "--json".startswith(word) for word in given)
    for name in LIBRARY_THREADS:
        os.environ.setdefault(name, "1")
    _prepare_streams()
    try:
        return _run(given)
    except (KeyboardInterrupt, Exception) as error:
        if isinstance(error, BrokenPipeError) and _reader_gone():  # e.g. `srbval ... | head`
            return 0
        from srbval.cli.output import missing_options, print_json

        message, code = _failure(error, resumed=bool(given) and given[0] in RESUMED)
        if not as_json and isinstance(error, SrbvalError) and error.questions:
            message = missing_options(error, given)
        with contextlib.suppress(OSError):
            print(f"srbval: {message}", file=sys.stderr)
            if as_json:
                print_json({"message": message, "exit_code": code}, status="failed")
        return code
    finally:
        _flush()


def _run(given: list[str]) -> int:
    from srbval.cli.arguments import build_parser

    options = build_parser().parse_args(given)
    if options.command is None:
        build_parser().print_help(sys.stderr)
        raise ConfigurationError("name a command, for example: srbval report")
    # The module of a command is imported only when it runs: `srbval --help` answers at once.
    from srbval.storage.content_store import stored_results

    if getattr(options, "machine", None):
        from srbval.cli.machine_file import apply_machine_file  # imports slow modules

        apply_machine_file(options)
    module, _, function = options.run.partition(":")
    command = getattr(importlib.import_module(f"srbval.cli.{module}"), function)
    # From here on a signal raises an exception, so that files are cleaned up; before, there are none.
    with _signals_as_exceptions(), stored_results(fresh=getattr(options, "fresh", False)) as read_utc:
        code: int = command(options)
        if read_utc:
            dates = min(read_utc) if len(read_utc) == 1 else f"{min(read_utc)} to {max(read_utc)}"
            again = "--fresh" if hasattr(options, "fresh") else "SRBVAL_FRESH=1"
            print(f"srbval: results from the cache, computed {dates}; {again} computes again", file=sys.stderr)
    sys.stdout.flush()
    return code


def _failure(error: BaseException, *, resumed: bool) -> tuple[str, int]:
    """Return message and exit code of an error; `resumed` is true if repeating the command continues its work."""
    if isinstance(error, KeyboardInterrupt):
        number = error.args[0] if error.args else signal.SIGINT
        by = "" if number == signal.SIGINT else f" by {number.name}"
        again = "; the same command continues" if resumed else ""
        return f"interrupted{by}; no incomplete file was left{again}", SIGNALLED + number
    if isinstance(error, OSError) and error.strerror:  # error of the system, such as a full disk
        error = DataError(f"{error.filename or 'output'}: {error.strerror}.")
    return (str(error), error.exit_code) if isinstance(error, SrbvalError) else (internal_error(error), INTERNAL)


def internal_error(error: BaseException) -> str:
    """Write the traceback of an unexpected error to a file and return a message that names the file."""
    where = "the command"
    with contextlib.suppress(OSError):
        handle, path = tempfile.mkstemp(prefix="srbval-error-", suffix=".txt")
        with open(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write("".join(traceback.format_exception(error)))
        where = f"the file {path}"
    problem = f"{type(error).__name__}: {error}"[:400]
    return str(SrbvalError(f"an error in srbval itself, {problem}. Please send {where} to the authors of srbval."))


@contextlib.contextmanager
def _signals_as_exceptions() -> Iterator[None]:
    """Context in which the first Ctrl-C, SIGTERM or SIGHUP raises `Interrupted`; ignored signals stay ignored."""
    main_thread = threading.current_thread() is threading.main_thread()
    usual = (signal.SIG_DFL, signal.default_int_handler)
    found = {n: signal.getsignal(n) for n in ENDING if main_thread and signal.getsignal(n) in usual}
    sent_again: list[threading.Timer] = []

    def handle(action: Any) -> None:
        for number in found:
            signal.signal(number, action)

    def end(number: int, frame: Any) -> None:
        hdf5 = sys.modules.get("srbval.storage.hdf5_files")
        if hdf5 is not None and frame.f_code in hdf5.CALLED_BY_HDF5:  # not within HDF5: later
            return send_again(number)
        handle(signal.SIG_IGN)  # do not interrupt the clean-up
        raise Interrupted(signal.Signals(number))

    def again(lost: Any) -> None:
        """Send the signal again if Python discarded its exception (described by `lost`), as it does in a destructor."""
        if not isinstance(lost.exc_value, KeyboardInterrupt):
            return before(lost)
        handle(end)
        return send_again(lost.exc_value.args[0] if lost.exc_value.args else signal.SIGINT)

    def send_again(number: int) -> None:
        if hasattr(signal, "pthread_kill"):
            sent_again.append(threading.Timer(0.05, os.kill, (os.getpid(), number)))
        else:  # on Windows `os.kill` ends the process at once
            sent_again.append(threading.Timer(0.05, signal.raise_signal, (number,)))
        sent_again[-1].start()

    before, sys.unraisablehook = sys.unraisablehook, again
    try:
        handle(end)
        yield
    finally:
        sys.unraisablehook = before
        for timer in sent_again:  # nothing would handle the signal any more
            handle(signal.SIG_IGN)
            timer.cancel()
            timer.join()
        for number, action in found.items():
            signal.signal(number, action)


def _reader_gone() -> bool:
    """True if the reader of standard output has closed the pipe."""
    try:
        look = select.poll()
        look.register(sys.stdout, 0)
        return any(event & select.POLLERR for _, event in look.poll(0))
    except (AttributeError, OSError, ValueError):  # no `poll` (Windows), or not a file
        return True


def _prepare_streams() -> None:
    """Replace closed standard streams by the null device; escape characters that a stream cannot encode."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            os.dup2(os.open(os.devnull, os.O_RDWR), number)
            setattr(sys, name, os.fdopen(number, "w" if number else "r", closefd=False))
        if number and hasattr(getattr(sys, name), "reconfigure"):
            getattr(sys, name).reconfigure(errors="backslashreplace")


def _flush() -> None:
    """Flush standard output and error; a stream that fails is redirected to the null device."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
