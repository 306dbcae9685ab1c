"""Download of open data sets: pinned addresses and hashes, only when asked."""

import logging
from pathlib import Path

from srbval.errors import DataError
from srbval.progress import Progress, silent
from srbval.recordings.datasets.description import DatasetDescription, ExpectedFile, dataset, known_datasets
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
    description = dataset(name)
    pinned = _pinned_files(description)
    target = Path(folder) if folder is not None else home_folder() / "recordings" / name
    progress("Download", 0.0)
    for done, file in enumerate(pinned, 1):
        _retrieve(file, target, description)
        progress("Download", done / len(pinned))
    return add(target)


def _pinned_files(description: DatasetDescription) -> list[ExpectedFile]:
    if description.access != "open":
        raise DataError(f"{description.name}: no download; {description.licence}. {description.source}.")
    pinned = [file for file in description.files if file.url and file.sha256]
    if not pinned:
        downloadable = ", ".join(d.name for d in known_datasets() if any(f.url and f.sha256 for f in d.files))
        raise DataError(
            f"{description.name}: no pinned files to download. Get it from {description.url} and register "
            f"its folder with `srbval data add DIR`. Downloadable: {downloadable}."
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
    except Exception as error:  # the network and its libraries fail in many ways; the remedy is the same
        raise DataError(
            f"{file.name} could not be downloaded from {file.url} ({first_line(error, LONGEST_REASON)}). Try again "
            f"with a network, or get the files from {description.url} and register their folder with "
            "`srbval data add DIR`."
        ) from None
