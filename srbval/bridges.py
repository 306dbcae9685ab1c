"""Bridges from the package's objects to notebooks, pandas and xarray.

An object of an early room is drawn by the report and made from arrays by the recordings. For that it calls a function
that `srbval` offers (`offered`), as pandas calls its plotting backend: no room has to know a later one.
"""

import functools
import html
import importlib
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from srbval.errors import SrbvalError


@functools.cache
def in_python(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """The `function` that the package offers under a name; its errors ask for keywords where they name options."""

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except SrbvalError as error:
            settings = importlib.import_module("srbval.recordings.settings")
            error.args = (settings.with_keywords(str(error)),)
            raise

    call.__module__, call.__qualname__ = "srbval", name  # by which it is pickled
    return call


def offered(name: str) -> Any:
    """The function or class that `srbval` offers under this name, loaded at its first use."""
    return getattr(importlib.import_module("srbval"), name)


def require_xarray() -> Any:
    """Import xarray, or raise an error with the command that installs it."""
    from srbval.storage.installation import MissingLibraryError

    try:
        import xarray
    except ImportError:
        raise MissingLibraryError("a data set of xarray", "xarray", "h5netcdf") from None
    return xarray


def attributes(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Attributes of a data set that netCDF can store: numbers and texts, anything else as JSON; None is left out."""
    from srbval.storage.json_files import to_json

    plain = {name: to_json(value) for name, value in facts.items() if value is not None}
    return {
        name: x if isinstance(x, int | float | str) else json.dumps(x) for name, x in plain.items() if x is not None
    }


class Shown:
    """Object that a notebook shows as a headline over a table, and that draws itself onto matplotlib axes."""

    def summary_table(self) -> tuple[str, Mapping[str, Any] | Sequence[Mapping[str, Any]]]:
        """Headline, and facts by name or rows of a table."""
        raise NotImplementedError

    def plot(self, ax: Any = None, **options: Any) -> Any:
        """Draw onto the matplotlib axes `ax`, by default onto new ones, and return them; see `srbval.draw`."""
        return offered("draw")(self, ax, **options)

    def _repr_html_(self) -> str:
        import pandas

        headline, table = self.summary_table()
        rows = [{"": name, "value": value} for name, value in table.items()] if isinstance(table, Mapping) else table
        frame = pandas.DataFrame(list(rows), dtype=object)
        shown = frame.map(_short).to_html(index=False, na_rep="–")
        return f"<p>{html.escape(headline)}</p>{shown}"


def _short(value: Any) -> Any:
    """A number with five digits, a list in words, any other value as it is."""
    if isinstance(value, float):
        return f"{value:.5g}" if value == value else "–"
    return ", ".join(map(str, value)) if isinstance(value, list | tuple) else "–" if value is None else value
