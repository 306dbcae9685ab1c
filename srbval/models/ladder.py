"""The ladder of models, cheapest first: one entry a rung, one interface.

A rung is a function ``run(account, settle, whole)`` that yields `chunk.Outputs` of consecutive output intervals with
the number of their first; the first `settle` of the `whole` are not recorded. It keeps the account's `wall_s` and
`compile_s`.
"""

from __future__ import annotations

import difflib
import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from srbval.errors import ConfigurationError


@dataclass(frozen=True, kw_only=True)
class Rung:
    """A model's `name`, what it is in a few words, and where its function stands, as ``module:function``.

    `columns`: those of `chunk.Outputs.out` that it fills; the others are NaN.
    `own_solver`: what integrates it, where that is not the scene's choice.
    """

    name: str
    title: str
    place: str
    columns: tuple[int, ...]
    own_solver: str | None = None

    @property
    def run(self) -> Callable[..., Any]:
        """The rung's function, imported only when it is asked for."""
        module, name = self.place.split(":")
        function: Callable[..., Any] = getattr(importlib.import_module(module), name)
        return function


RUNGS = (
    Rung(
        name="full",
        title="point clouds against barrel rollers, 82 free coordinates",
        place="srbval.models.simulate:full_model",
        columns=tuple(range(21)),
    ),
)
MODELS = tuple(rung.name for rung in RUNGS)


def rung_of(name: str) -> Rung:
    """The rung of that name; `ConfigurationError` with the nearest one for an unknown name."""
    check_known("model", name, MODELS)
    return next(rung for rung in RUNGS if rung.name == name)


def check_known(what: str, name: str, known: tuple[str, ...]) -> None:
    """Raise `ConfigurationError` for a name that is none of the `known`."""
    if name not in known:
        close = difflib.get_close_matches(name, known, n=1, cutoff=0.4)
        hint = f" Did you mean {close[0]!r}?" if close else ""
        raise ConfigurationError(f"{what} {name!r} is not known.{hint} Known: {', '.join(known)}.")
