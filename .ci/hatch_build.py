"""README and project URLs of a release: the repository that publishes it is `SRBVAL_REPOSITORY`, if that is set."""

import os
import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

RELATIVE_LINK = re.compile(r"(?P<image>!?)(?P<text>\[[^\]]*\])\((?P<place>(?![a-z]+:)[^)]+)\)")


class Published(MetadataHookInterface):
    """On the package index, relative links of the README lead nowhere: they become links to the version's tag."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set `readme` and `urls`; without a repository the links stay and its URLs are absent."""
        text, urls = Path(self.root, "README.md").read_text(encoding="utf-8"), dict(self.config["urls"])
        repository, tag = os.environ.get("SRBVAL_REPOSITORY"), f"v{metadata['version']}"
        if repository:
            urls["Source"] = repository
            urls["Issues"] = f"{repository}/issues"
            urls["Changelog"] = f"{repository}/blob/{tag}/CHANGELOG.md"

            def absolute(link: re.Match[str]) -> str:
                kind = "raw" if link["image"] else "blob"
                return f"{link['image']}{link['text']}({repository}/{kind}/{tag}/{link['place']})"

            text = RELATIVE_LINK.sub(absolute, text)
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
        metadata["urls"] = urls
