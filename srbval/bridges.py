"""Bridges from the package's objects to notebooks, pandas and xarray.

An object of an early room is drawn by the report and made from arrays by the recordings. For that it calls a function
that `srbval` offers (`load_public`), as pandas calls its plotting backend: no room has to know a later one.
"""

import functools
import html
import importlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from srbval.errors import SrbvalError


@functools.cache
def with_keyword_errors(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
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


def load_public(name: str) -> Any:
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


class NotebookObject:
    """Object that a notebook shows as a headline over a table, and that draws itself onto matplotlib axes."""

    def summary_table(self) -> tuple[str, Mapping[str, Any] | Sequence[Mapping[str, Any]]]:
        """Headline, and facts by name or rows of a table; here the representation and all numbers and texts."""
        facts = {name: x for name, x in vars(self).items() if isinstance(x, str | float | int) and x == x}
        return repr(self).strip("<>"), facts

    def plot(self, ax: Any = None, **options: Any) -> Any:
        """Draw onto the matplotlib axes `ax`, by default onto new ones, and return them; see `srbval.plot`."""
        return load_public("plot")(self, ax, **options)

    def _repr_html_(self) -> str:
        import pandas

        headline, table = self.summary_table()
        rows = table.items() if isinstance(table, Mapping) else [row.values() for row in table]
        names = ["", "value"] if isinstance(table, Mapping) else [*table[0]] if table else []
        shown = [[f"{x:.5g}" if isinstance(x, float) else "–" if x is None else x for x in row] for row in rows]
        return f"<p>{html.escape(headline)}</p>{pandas.DataFrame(shown, columns=names).to_html(index=False)}"
