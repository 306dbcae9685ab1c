"""Inline markup marks; text from elsewhere stays text."""

from hypothesis import given
from hypothesis import strategies as st

from srbval.report.plain import literal, printable, spans


def test_strong_and_code_are_marked():
    assert spans("a **b** `c`") == (("text", "a "), ("strong", "b"), ("text", " "), ("code", "c"))


def test_a_marker_alone_is_text():
    assert spans("2 * 3 ** 4 ` 5") == (("text", "2 * 3 ** 4 ` 5"),)


@given(st.text())
def test_literal_text_comes_back_unchanged_as_one_run(text):
    """But for the kind of its blanks."""
    expected = printable(text).replace("\u00a0", " ")
    found = tuple((kind, part.replace("\u00a0", " ")) for kind, part in spans(literal(text)))
    assert found == ((("text", expected),) if expected else ())


def test_no_line_ends_within_a_quantity():
    text = "+0.15 ± 0.21 % at 877 rpm, 2 m/s² in 1400 to 2800 Hz; 3 members, `2 m`"
    held = "+0.15\u00a0±\u00a00.21\u00a0% at 877\u00a0rpm, 2\u00a0m/s² in 1400 to 2800\u00a0Hz; 3 members, "
    assert spans(text) == (("text", held), ("code", "2 m"))


def test_controls_and_direction_overrides_are_replaced():
    assert printable("a\x00b\u202ec\ud800") == "a\ufffdb\ufffdc\ufffd"
