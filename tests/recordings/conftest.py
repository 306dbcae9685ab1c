"""Commands, until the fixtures of the same names are shared."""

import json

import pytest

from srbval.cli import main


@pytest.fixture
def srbval_text(capsys):
    """Run a command line that ends with the exit code `code`; returns what it printed, `out` and `err`."""

    def run(*words, code=0):
        capsys.readouterr()
        assert main([str(word) for word in words]) == code
        return capsys.readouterr()

    return run


@pytest.fixture
def srbval_json(srbval_text):
    """Run a command line with --json; returns the document, which has neither NaN nor Infinity."""

    def run(*words, code=0):
        text = srbval_text(*words, "--json", code=code).out
        return json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))

    return run
