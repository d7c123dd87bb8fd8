"""What a terminal shows of a character that its encoding does not have."""

import io
import sys

import pytest

from gateway.cli import plain_spelling
from gateway.cli.live_monitor.drawing import big
from gateway.cli.main import _print_what_the_terminal_can


@pytest.fixture
def spelled():
    plain_spelling.register()

    def spell(text: str, encoding: str) -> str:
        stream = io.TextIOWrapper(io.BytesIO(), encoding, errors=plain_spelling.ERRORS)
        stream.write(text)
        stream.flush()
        return stream.buffer.getvalue().decode(encoding)

    return spell


def test_a_number_keeps_its_sign_and_its_unit(spelled) -> None:
    """−1.18 N stood as ?1.18 N where the encoding has no minus."""
    assert spelled("−1.18 N ±0.06 · 1 × 0.5 V", "ascii") == "-1.18 N +-0.06 . 1 x 0.5 V"
    assert spelled("−1.18 N ±0.06", "latin-1") == "-1.18 N ±0.06"


def test_the_digits_of_the_monitor_can_be_told_apart_in_ascii(spelled) -> None:
    """Each was the same rows of question marks as another."""
    digits = {
        "\n".join(spelled(row.plain, "ascii") for row in big(float(digit), 0, width=9, style="")) for digit in range(10)
    }
    assert len(digits) == 10 and not any("?" in digit for digit in digits)


@pytest.mark.parametrize("text", ["Ω", "\udcff", "漢"])
def test_what_looks_like_nothing_else_is_a_question_mark(spelled, text: str) -> None:
    assert spelled(f"a{text}b", "ascii") == "a?b"


@pytest.mark.parametrize(
    ("encoding", "errors", "shown"),
    [
        ("ascii", "surrogateescape", b"1 . 2 ?"),
        ("latin-1", "strict", b"1 \xb7 2 ?"),
        ("utf-8", "surrogateescape", b"1 \xc2\xb7 2 \xff"),
    ],
)
def test_what_python_opens_in_a_c_locale_ends_no_verb(
    encoding: str, errors: str, shown: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`LC_ALL=C PYTHONUTF8=0 force-gateway monitor` ended with E500 and a UnicodeEncodeError."""
    out = io.TextIOWrapper(io.BytesIO(), encoding, errors=errors)
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    _print_what_the_terminal_can()
    out.write("1 · 2 \udcff")
    out.flush()
    assert out.buffer.getvalue() == shown
