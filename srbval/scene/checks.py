"""Checks that several parts of a scene share."""

from __future__ import annotations

from srbval.errors import ConfigurationError


def positive(owner: object, *names: str) -> None:
    """Refuse fields of `owner` that are not above zero."""
    for name in names:
        value = getattr(owner, name)
        if not value > 0:
            raise ConfigurationError(f"{name} = {value} must be positive.")


def not_negative(owner: object, *names: str) -> None:
    """Refuse fields of `owner` that are below zero."""
    for name in names:
        value = getattr(owner, name)
        if value < 0:
            raise ConfigurationError(f"{name} = {value} must not be negative.")
