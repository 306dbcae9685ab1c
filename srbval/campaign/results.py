"""What the result files of a campaign say: each intact, damaged or missing, and read once."""

import stat
import time
from collections.abc import Iterable
from pathlib import Path

from srbval.campaign.campaign_folder import CampaignFolder, Damaged, damaged_file
from srbval.campaign.case_file import CaseResult, read_result
from srbval.errors import DataError


class Results:
    """Results of `keys` in a folder, those that are `intact` and those that are `damaged`; the others are missing."""

    def __init__(self, folder: CampaignFolder, keys: Iterable[str]) -> None:
        self._folder = folder
        self.intact: dict[str, CaseResult] = {}
        self.damaged: dict[str, Damaged] = {}
        self.read(keys)

    def read(self, keys: Iterable[str]) -> None:
        """Read these results, again if need be."""
        for key in dict.fromkeys(keys):
            found = result_state(self._folder.result_path(key))
            self.intact.pop(key, None)
            self.damaged.pop(key, None)
            if isinstance(found, Damaged):
                self.damaged[key] = found
            elif found is not None:
                self.intact[key] = found

    def remove(self, keys: Iterable[str]) -> None:
        """Remove these results; a folder in the place of one is renamed, since this program did not write it."""
        for key in list(keys):
            path = self._folder.result_path(key)
            try:
                if path.is_dir() and not path.is_symlink():
                    path.rename(path.with_name(f"{path.name}.{time.time_ns()}.aside"))
                else:
                    path.unlink(missing_ok=True)
            except OSError as error:
                raise DataError(f"{path}: damaged, and cannot be removed ({error.strerror}). Remove it.") from None
            self.read([key])


def result_state(path: Path) -> CaseResult | Damaged | None:
    """The result in a file, what is wrong with that file, or None where there is none."""
    try:
        if not stat.S_ISREG(path.lstat().st_mode):
            return Damaged(file=path, why="a link, a folder or another kind of file is in a result's place.")
        return read_result(path)
    except FileNotFoundError:
        return None
    except (OSError, DataError) as error:
        return damaged_file(path, error)
