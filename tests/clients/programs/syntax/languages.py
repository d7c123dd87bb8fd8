"""Parses a text in one of the languages: RAPID, SCL, Structured Text, URScript.

Small and strict: what is not known is a SyntaxError with its line.
"""

from collections.abc import Callable
from functools import cache

from tests.clients.programs.syntax.iec import Iec
from tests.clients.programs.syntax.parser import Unit
from tests.clients.programs.syntax.rapid import Rapid
from tests.clients.programs.syntax.tokens import Token, pattern_of, tokenize
from tests.clients.programs.syntax.urscript import UrScript

WORD = r"[A-Za-z_][A-Za-z0-9_]*"
PATTERNS = {
    "rapid": pattern_of(r"![^\n]*", r'"[^"\n]*"', WORD),
    "scl": pattern_of(r"//[^\n]*", r"""'(?:[^'$\n]|\$.)*'|"[^"\n]*\"""", r"\#?" + WORD),
    "st": pattern_of(r"\(\*.*?\*\)|//[^\n]*", r"'(?:[^'$\n]|\$.)*'", WORD),
    "urscript": pattern_of(r"\#[^\n]*", r'"[^"\n]*"', WORD),
}
START: dict[str, Callable[[list[Token]], Unit]] = {
    "rapid": lambda tokens: Rapid(tokens).module(),
    "scl": lambda tokens: Iec(tokens).source(),
    "st": lambda tokens: Iec(tokens).source(),
    "urscript": lambda tokens: UrScript(tokens).script(),
}


@cache
def parse(text: str, language: str) -> Unit:
    return START[language](tokenize(text, PATTERNS[language], newlines=language == "urscript"))
