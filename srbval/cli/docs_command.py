"""``srbval docs``: the whole documentation as pages that need no network, built from what ships with the program."""

import argparse
import webbrowser
from pathlib import Path

from srbval.cli.output import print_json
from srbval.errors import ConfigurationError, DataError
from srbval.progress import ProgressDisplay, stage
from srbval.storage.installation import package_folder


def run(options: argparse.Namespace) -> int:
    """Build, print where the first page is, and open it where asked."""
    with ProgressDisplay() as progress, stage(progress, "Build the documentation"):
        page = build_docs(Path(options.output))
    if options.json:
        print_json({"page": str(page)})
    else:
        print(page)
    if options.open:
        webbrowser.open(page.resolve().as_uri())
    return 0


def build_docs(folder: Path) -> Path:
    """Build the pages into `folder` and return the first one.

    Raises `ConfigurationError` without Sphinx, `DataError` where the folder cannot be written.
    """
    try:
        import myst_parser  # noqa: F401
        from sphinx.cmd.build import build_main
    except ImportError:
        raise ConfigurationError(
            'building the documentation needs Sphinx, which is not installed: pip install "srbval[docs]". Its text '
            f"lies in {package_folder() / 'docs'}."
        ) from None
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:  # a path with a NUL or a lone surrogate is a ValueError
        raise DataError(f"{folder}: cannot be written ({getattr(error, 'strerror', None) or error}).") from None
    code = build_main(["-q", str(package_folder() / "docs"), str(folder)])
    if code:
        raise DataError(f"{folder}: Sphinx could not build the documentation (it ended with {code}; see above).")
    return folder / "index.html"
