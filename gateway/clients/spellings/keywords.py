"""Names that a language cannot have: too long, or its own. A map of the user's may have names of its own."""

import re
from collections import Counter
from collections.abc import Iterator
from typing import Final

from gateway.clients.exchange import STATUS_BITS, ExchangeTable

_LONGEST: Final = {"rapid": 32}  # of an identifier, with what the client sets before a name
_KEYWORDS: Final = {
    "st": "abs acos action add adr and andn any array asin at atan bitadr bool by byte cal calc calcn case "
    "configuration constant continue cos date dint div do dt dword else elsif end eq exit exp expt false for "
    "from function ge goto gt if indexof int interface jmp jmpc jmpcn ld le limit lint ln log lreal lt ltime "
    "lword max method min mod move mul mux ne not of on or orn params persistent pointer private program "
    "property protected public r real reference repeat resource ret retain retc retcn return rol ror s sel shl "
    "shr sin sint sizeof sqrt st step stn string struct sub super tan task then this time to tod transition true "
    "trunc type udint uint ulint union until usint var while with word wstring xor xorn",
    "scl": "and any array at begin bool by byte case char continue counter date dint div do dt dword else elsif exit "
    "false for function goto if int label lint lreal mod nil not of or pointer program real region repeat "
    "return sint string struct then time timer to tod true type udint uint ulint until usint var variant "
    "version void while with word xor",
    "c": "auto bool break case char class const continue default delete do double else enum export extern "
    "float for friend goto if inline int long mutable namespace new operator private protected public "
    "register restrict return short signed sizeof static struct switch template this throw try typedef "
    "typename union unsigned using virtual void volatile while",
}
"""Of Structured Text (with its operators and those of instruction lists, which TwinCAT and CODESYS reserve) and SCL, whose
structures have the registers as members; of C with those of C++."""
_CONSTANT: Final = {
    "rapid": re.compile(r"^  (?:LOCAL )?CONST \w+ (FG_\w+)", re.M),
    "urscript": re.compile(r"^global (FG_\w+) =", re.M),
    "c": re.compile(r"\b(FG_[A-Z0-9_]+) = [0-9]"),
}
"""Where a text has a constant of its own, or one of the map's names."""


def unspeakable(table: ExchangeTable, language: str) -> Iterator[str]:
    """Yield in a sentence each name of the map that this language cannot have."""
    if longest := _LONGEST.get(language):
        for before, name in _constants(table):
            if len(name) > (room := longest - len(before)):
                yield f"{name} has {len(name)} characters, and {language} has room for {room}"
    members = (*(register.name for register in (*table.command, *table.status)), *table.self_test_words)
    yield from (
        f"{name} is a word of {language} itself" for name in members if name in _KEYWORDS.get(language, "").split()
    )
    if language in _KEYWORDS:
        for register in table.status:
            if register.name in STATUS_BITS:
                yield f"{register.name} is the name of a bit in the client's status"


def doubled(text: str, language: str) -> Iterator[str]:
    """Yield in a sentence each constant that a client's text has twice: its own, and one of the map's names."""
    if pattern := _CONSTANT.get(language):
        yield from (
            f"{name} stands twice in {language}" for name, count in Counter(pattern.findall(text)).items() if count > 1
        )


def _constants(table: ExchangeTable) -> Iterator[tuple[str, str]]:
    """Yield each name of the map that becomes a constant, behind what the client sets before it."""
    yield from (("FG_S_", register.name) for register in (*table.command, *table.status))
    yield from (("FG_M_", each.name) for each in table.model_fields)
    yield from (("FG_T_", name) for name in table.self_test_words)
    yield from (
        ("FG_", name) for word in ("control_word", "status_word") for name in table.map.find(word).bits.values()
    )
    yield from (("FG_COMMIT_", name) for name in table.at("commit_status", "staging").values.values())
