"""The words of a text in one of the languages, each with its line."""

import re
from dataclasses import dataclass

TOKENS = re.compile(
    r"""(?P<space>[ \t]+)|(?P<newline>\n)|(?P<comment>{comment})
    |(?P<number>(?:16\#[0-9A-F_]+|T\#[0-9]+(?:ms|s|MS|S)|[0-9]+(?:\.[0-9]+)?(?:E[+-]?[0-9]+)?))
    |(?P<string>{string})
    |(?P<name>{name})
    |(?P<op>:=|=>|<>|<=|>=|==|!=|\.\.|\.%[WX][0-9]+|[-+*/%=<>()\[\]{{}},;:.\\])""",
    re.X,
)


@dataclass(frozen=True)
class Token:
    kind: str
    text: str
    line: int


def pattern_of(comment: str, string: str, name: str) -> re.Pattern[str]:
    return re.compile(TOKENS.pattern.format(comment=comment, string=string, name=name), re.X | re.S)


def tokenize(text: str, pattern: re.Pattern[str], *, newlines: bool = False) -> list[Token]:
    tokens, place, line = [], 0, 1
    while place < len(text):
        found = pattern.match(text, place)
        if not found:
            raise SyntaxError(f"line {line}: {text[place : place + 30]!r} is no word of this language")
        kind, word = str(found.lastgroup), found.group()
        if kind == "newline" and newlines:
            tokens.append(Token("op", "\n", line))
        elif kind not in ("space", "comment", "newline"):
            tokens.append(Token(kind, word, line))
        line += word.count("\n")
        place = found.end()
    return [*tokens, Token("end", "", line)]
