"""Inline markup marks; text from elsewhere stays text."""

from hypothesis import given
from hypothesis import strategies as st

from srbval.report.inline import literal, printable, spans


def test_strong_and_code_are_marked():
    assert spans("a **b** `c`") == (("text", "a "), ("strong", "b"), ("text", " "), ("code", "c"))


def test_a_marker_alone_is_text():
    assert spans("2 * 3 ** 4 ` 5") == (("text", "2 * 3 ** 4 ` 5"),)


@given(st.text())
def test_literal_text_comes_back_unchanged_as_one_run(text):
    expected = printable(text)
    assert spans(literal(text)) == ((("text", expected),) if expected else ())


def test_controls_and_direction_overrides_are_replaced():
    assert printable("a\x00b\u202ec\ud800") == "a\ufffdb\ufffdc\ufffd"
