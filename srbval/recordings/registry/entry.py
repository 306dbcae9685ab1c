"""One registered file, and a list of them as the `data` commands report it."""

from __future__ import annotations

import dataclasses
import enum
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.recordings.recording import Origin
from srbval.recordings.registry.coverage_point import Coverage
from srbval.recordings.settings import Settings

SCHEMA_VERSION = 1


class Status(enum.StrEnum):
    """What a look at the file says, against what was pinned when it was registered."""

    OK = "ok"
    CHANGED = "changed"
    MISSING = "missing"
    TRUNCATED = "truncated"
    UNREADABLE = "unreadable"


@dataclass(frozen=True, kw_only=True)
class RegisteredRecording:
    """A file of the register. `sha256`, `size_bytes` and `mtime_ns` are those pinned at first use.

    Loads in kN, `fs_hz` in Hz; what the file does not say is None. `reason` explains any status
    but ok, and what an ok file leaves open. `settings` is what the user settled when registering it.
    """

    file: str
    sha256: str
    size_bytes: int
    mtime_ns: int
    status: Status
    reason: str | None = None
    format: str | None = None
    origin: Origin | None = None
    dataset: str | None = None
    state: Fault | None = None
    radial_kn: float | None = None
    axial_kn: float | None = None
    nominal_rpm: float | None = None
    fs_hz: float | None = None
    seconds: float | None = None
    channels: tuple[str, ...] = ()
    channel: str | None = None
    settings: Settings | None = None

    def with_status(self, status: Status, reason: str | None = None) -> RegisteredRecording:
        """The same file with another status."""
        return dataclasses.replace(self, status=status, reason=reason)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, the keys of the public interface among them."""
        return dataclasses.asdict(self) | {"channels": list(self.channels)}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> RegisteredRecording:
        """Rebuild from `to_dict`; raises what reading a manifest expects for anything else."""
        state, origin, settings = values.get("state"), values.get("origin"), values.get("settings")
        return cls(
            **values
            | {
                "status": Status(values["status"]),
                "state": None if state is None else Fault(state),
                "origin": None if origin is None else Origin(origin),
                "channels": tuple(values.get("channels", ())),
                "settings": None if settings is None else Settings(**settings),
            }
        )


@dataclass(frozen=True, kw_only=True)
class Listing:
    """The register, or the part of it a command touched, and the grids of operating points it covers."""

    manifest: Path
    recordings: tuple[RegisteredRecording, ...]
    coverage: tuple[Coverage, ...] = ()

    @property
    def problems(self) -> tuple[RegisteredRecording, ...]:
        """Recordings that are not ok; texts that never were one (a licence, a readme) do not count."""
        return tuple(
            r
            for r in self.recordings
            if r.status is not Status.OK and not (r.status is Status.UNREADABLE and r.format == "text")
        )

    def to_dict(self) -> dict[str, Any]:
        """The JSON document of `srbval data`."""
        return {
            "schema_version": SCHEMA_VERSION,
            "status": "problems" if self.problems else "ok",
            "manifest": str(self.manifest),
            "recordings": [r.to_dict() for r in self.recordings],
            "coverage": [c.to_dict() for c in self.coverage],
        }
