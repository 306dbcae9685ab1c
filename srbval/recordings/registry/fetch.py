"""Download of open data sets: pinned addresses and hashes, only when asked."""

from __future__ import annotations

import logging
from pathlib import Path

from srbval.errors import DataError
from srbval.progress import Progress, silent
from srbval.recordings.datasets.description import DatasetDescription, ExpectedFile, dataset, known_datasets
from srbval.recordings.registry.entry import Listing
from srbval.recordings.registry.home import home_folder
from srbval.recordings.registry.verbs import add

TIMEOUT_S = 30


def fetch(name: str, folder: str | Path | None = None, *, progress: Progress = silent) -> Listing:
    """Download the open data set `name` into `folder` (default: below the home folder) and register it.

    Files that are there with the right SHA-256 are kept, so an interrupted download goes on where it
    stopped. Raises `DataError` for a set that is
    restricted or has no pinned files, and without a network, each with the way out.
    """
    description = dataset(name)
    pinned = _pinned_files(description)
    target = Path(folder) if folder is not None else home_folder() / "recordings" / name
    for done, file in enumerate(pinned):
        progress("Download", done / len(pinned))
        _retrieve(file, target, description)
    progress("Download", 1.0)
    return add(target)


def _pinned_files(description: DatasetDescription) -> list[ExpectedFile]:
    if description.access != "open":
        raise DataError(f"{description.name}: no download; {description.licence}. {description.source}.")
    pinned = [file for file in description.files if file.url and file.sha256]
    if not pinned:
        able = ", ".join(d.name for d in known_datasets() if any(f.url and f.sha256 for f in d.files))
        raise DataError(
            f"{description.name}: no pinned files to download. Get it from {description.url} and register "
            f"its folder with `srbval data add DIR`. Downloadable: {able}."
        )
    return pinned


def _retrieve(file: ExpectedFile, target: Path, description: DatasetDescription) -> None:
    import pooch

    pooch.get_logger().setLevel(logging.WARNING)
    try:
        pooch.retrieve(
            url=file.url,
            known_hash=f"sha256:{file.sha256}",
            fname=file.name,
            path=target,
            downloader=pooch.HTTPDownloader(timeout=TIMEOUT_S),
        )
    except Exception as error:  # the network and its libraries fail in many ways; the way out is the same
        text = str(error).split("\n", 1)[0][:160] or type(error).__name__
        raise DataError(
            f"{file.name} could not be downloaded from {file.url} ({text}). Try again with a network, or get "
            f"the files from {description.url} and register their folder with `srbval data add DIR`."
        ) from None
