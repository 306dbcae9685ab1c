"""Download of open data sets: pinned addresses and hashes, only when asked."""

import logging
from pathlib import Path

from srbval.errors import DataError
from srbval.progress import Progress, silent
from srbval.recordings.datasets.description import dataset, known_datasets
from srbval.recordings.raw import first_line
from srbval.recordings.registry.entry import RegisterListing
from srbval.recordings.registry.manifest import home_folder
from srbval.recordings.registry.register import add

TIMEOUT_S = 30
LONGEST_REASON = 160


def fetch(name: str, folder: str | Path | None = None, *, progress: Progress = silent) -> RegisterListing:
    """Download the open data set `name` into `folder` (default: below the home folder) and register it.

    Files that exist with the right SHA-256 are kept, so an interrupted download continues where it
    stopped. `progress` is the share of the files. Raises `DataError` for a set that is restricted or has no pinned
    files, and without a network, each with the remedy.
    """
    import pooch

    wanted = dataset(name)
    if wanted.access != "open":
        raise DataError(f"{wanted.name}: no download; {wanted.licence}. {wanted.source}.")
    by_hand = f"{wanted.url} and register"
    pinned = [file for file in wanted.files if file.url and file.sha256]
    if not pinned:
        downloadable = ", ".join(d.name for d in known_datasets() if any(f.url and f.sha256 for f in d.files))
        raise DataError(
            f"{wanted.name}: no pinned files to download. Get it from {by_hand} its folder with `srbval data add DIR`. "
            f"Downloadable: {downloadable}."
        )
    target = Path(folder) if folder is not None else home_folder() / "recordings" / name
    downloader = pooch.HTTPDownloader(timeout=TIMEOUT_S)
    pooch.get_logger().setLevel(logging.WARNING)
    progress("Download", 0.0)
    for done, file in enumerate(pinned, 1):
        known = f"sha256:{file.sha256}"
        try:
            pooch.retrieve(url=file.url, known_hash=known, fname=file.name, path=target, downloader=downloader)
        except Exception as error:  # the network and its libraries fail in many ways; the remedy is the same
            raise DataError(
                f"{file.name} could not be downloaded from {file.url} ({first_line(error, LONGEST_REASON)}). Try again "
                f"with a network, or get the files from {by_hand} their folder with `srbval data add DIR`."
            ) from None
        progress("Download", done / len(pinned))
    return add(target)
