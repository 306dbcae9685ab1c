"""Entry point of the program: ``srbval`` and ``python -m srbval``."""

import _signal  # type: ignore[import-not-found]  # `signal` takes some milliseconds to import
import sys

# Until the command handles it, Ctrl-C ends the process at once, like other signals: an exception in the middle
# of an import would leave modules half loaded.
if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)


def main() -> int:
    """Run the command on the command line and return its exit code."""
    from srbval import cli

    return cli.run_command_line()


if __name__ == "__main__":
    sys.exit(main())
