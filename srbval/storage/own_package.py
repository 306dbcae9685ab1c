"""Old names of `installation`."""

from srbval.storage.installation import child_environment, git_revision, package_folder, shipped_folder

__all__ = ["child_environment", "git_revision", "package_folder", "shipped_folder"]
