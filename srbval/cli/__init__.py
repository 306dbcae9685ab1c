"""The command line: `srbval COMMAND`. Thin; everything it does is callable from Python."""

from srbval.cli.main import main

__all__ = ["main"]
