"""Links from the package's objects to notebooks, pandas and xarray.

The modules that draw figures import the modules of runs and recordings. To avoid a circular import, a run or recording
looks up the drawing function among the public names of `srbval` only when it is drawn (`load_public`).
"""

import functools
import html
import importlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from srbval.errors import SrbvalError
from srbval.storage.installation import import_library


@functools.cache
def with_keyword_errors(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap `function`, whose public name is `name`: its errors then name Python keywords, not command-line options."""

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except SrbvalError as error:
            settings = importlib.import_module("srbval.recordings.settings")
            error.args = (settings.with_keywords(str(error)),)
            raise

    call.__module__, call.__qualname__ = "srbval", name  # pickled under this name
    return call


def load_public(name: str) -> Any:
    """Import the public function or class `name` of `srbval`."""
    return getattr(importlib.import_module("srbval"), name)


def require_xarray() -> Any:
    """Import xarray and return it; if it is missing, raise an error that contains the install command."""
    return import_library("xarray", "a data set of xarray", "xarray", "h5netcdf")


class NotebookObject:
    """Base class of objects that a notebook displays as a headline with a table, and that `plot` draws."""

    def summary_table(self) -> tuple[str, Mapping[str, Any] | Sequence[Mapping[str, Any]]]:
        """Headline and table (values by name, or one mapping per row); by default all fields with a number or text."""
        facts = {name: x for name, x in vars(self).items() if isinstance(x, str | float | int) and x == x}
        return repr(self).strip("<>"), facts

    def plot(self, ax: Any = None, **options: Any) -> Any:
        """Draw the object on matplotlib axes (default: new ones) and return them; `options` as in `srbval.plot`."""
        return load_public("plot")(self, ax, **options)

    def _repr_html_(self) -> str:
        import pandas

        headline, table = self.summary_table()
        rows = [{"": name, "value": x} for name, x in table.items()] if isinstance(table, Mapping) else table
        frame = pandas.DataFrame(rows, dtype=object)
        shown = frame.map(lambda x: f"{x:.5g}" if isinstance(x, float) else "–" if x is None else x)
        return f"<p>{html.escape(headline)}</p>{shown.to_html(index=False)}"
