"""How each language spells the lists of a client: constants, decoding of the status block, tables of texts."""

from collections.abc import Callable
from typing import Final

from gateway.clients.exchange import ExchangeTable
from gateway.clients.spellings.c import spell_c
from gateway.clients.spellings.iec import spell_scl, spell_st
from gateway.clients.spellings.python import spell_python
from gateway.clients.spellings.rapid import spell_rapid
from gateway.clients.spellings.urscript import spell_urscript

SPELLINGS: Final[dict[str, Callable[[ExchangeTable], dict[str, str]]]] = {
    "rapid": spell_rapid,
    "scl": spell_scl,
    "st": spell_st,
    "urscript": spell_urscript,
    "c": spell_c,
    "python": spell_python,
}
"""Language -> the lists that its template names."""
