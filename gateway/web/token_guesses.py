"""How often an address may be wrong about the page's token. Pure: time is an argument.

A few wrong ones are a person's slips, or a program with the token of before. Behind them an address has one a second: of what
it sends meanwhile nothing is looked at, for an answer to the right one would tell it from all others. Other addresses wait for
nothing, nor does whoever has logged in; who shares the address of a guesser (behind a proxy that does not name its callers) and
has not logged in waits with it.
"""

from contextlib import suppress
from ipaddress import IPv6Address, ip_address
from typing import Final

GUESSES_AT_ONCE: Final = 10
GUESS_S: Final = 1.0
MOST_ADDRESSES: Final = 1024
_IPV6_PREFIX: Final = 64  # bits: what one host's network has at least, and may draw its addresses from


class TokenGuesses:
    """Who has been wrong of late."""

    def __init__(self) -> None:
        self._paid_s: dict[str, float] = {}  # by address: when all of its wrong ones have had their second

    def __len__(self) -> int:
        return len(self._paid_s)

    def wait_s(self, address: str, now_s: float) -> float:
        """Return the seconds until a token of this address is looked at; 0 where it is now."""
        owed_s = self._paid_s.get(_key(address), now_s) - now_s
        return max(0.0, owed_s - (GUESSES_AT_ONCE - 1) * GUESS_S)

    def note_wrong(self, address: str, now_s: float) -> None:
        """Count a wrong token; where too many addresses are known, the one that is free soonest is forgotten."""
        key = _key(address)
        self._paid_s[key] = max(self._paid_s.get(key, now_s), now_s) + GUESS_S
        if len(self._paid_s) > MOST_ADDRESSES:
            del self._paid_s[min(self._paid_s, key=self._paid_s.__getitem__)]


def _key(address: str) -> str:
    """What a proxy names may be anything: all that is no address counts as one."""
    with suppress(ValueError):
        known = ip_address(address)
        if isinstance(known, IPv6Address):
            return str(known.ipv4_mapped or int(known) >> (128 - _IPV6_PREFIX))
        return str(known)
    return ""
