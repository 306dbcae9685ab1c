"""The options that say what a recording leaves open, the same in `srbval analyse` and `srbval data add`."""

from __future__ import annotations

import argparse

from srbval.recordings.settings import Settings


def settings_of(options: argparse.Namespace) -> Settings:
    """Settings from --channel, --fs, --unit and --rpm."""
    return Settings(channel=options.channel, fs_hz=options.fs, unit=options.unit, rpm=options.rpm)
