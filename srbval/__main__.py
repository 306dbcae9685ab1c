"""The program: ``srbval`` and ``python -m srbval``."""

import signal
import sys

# Until the command can answer it, Ctrl-C ends the process at once, as the other signals do: an exception in the middle
# of an import leaves modules half loaded.
if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def main() -> int:
    """Run the command that the program was started with; returns its exit code."""
    from srbval import cli

    return cli.main()


if __name__ == "__main__":
    sys.exit(main())
