"""The command line: `srbval COMMAND`. Thin; everything it does is callable from Python."""

import importlib
import os
import sys
from collections.abc import Sequence

from srbval.cli.arguments import parser
from srbval.cli.output import print_failure
from srbval.errors import ConfigurationError, SrbvalError

INTERRUPTED = 130
# Numerical libraries start one thread per core for small products, which then wait for each other: up to 30 times the
# work.
THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code (0 done, 1 out of tolerance, 2 use, 3 data, 4 numerics)."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    as_json = "--json" in given
    for name in THREADS:
        os.environ.setdefault(name, "1")
    try:
        options = parser().parse_args(given)
        if options.command is None:
            parser().print_help(sys.stderr)
            raise ConfigurationError("name a command, for example: srbval report")
        # The module of a command is imported only when it runs: `srbval --help` answers at once.
        code: int = importlib.import_module(f"srbval.cli.{options.command}_command").run(options)
        sys.stdout.flush()
        return code
    except SrbvalError as error:
        print_failure(str(error), error.exit_code, as_json=as_json)
        return error.exit_code
    except KeyboardInterrupt:
        print_failure("interrupted; nothing half-written was left behind", INTERRUPTED, as_json=as_json)
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our output went away, e.g. `srbval ... | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
