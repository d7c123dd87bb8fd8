"""A client as text: the template of its language, filled in from the exchange table.

The templates lie in templates/, one per language, and hold what a programmer of that machine would write by hand; only lists
(constants, decoding, tables of texts) are spelled here, by gateway.clients.spellings.
"""

from collections.abc import Iterator
from importlib.resources import files
from ipaddress import ip_address
from string import Template
from typing import Final

from gateway import defaults
from gateway.clients.endpoint import Endpoint
from gateway.clients.exchange import ExchangeTable
from gateway.clients.spellings import SPELLINGS
from gateway.clients.spellings.keywords import doubled, unspeakable
from gateway.control.settings import LeaseAction
from gateway.profiles import Rig
from gateway.registers.map.register_map import RegisterMap

TEMPLATES: Final = {
    "rapid": "rapid.mod",
    "scl": "simatic.scl",
    "st": "codesys.st",
    "urscript": "universal.script",
    "c": "c.h",
    "python": "python.txt",
}
"""Language -> file of its template."""

LANGUAGES: Final = tuple(TEMPLATES)

_REMARKS: Final = {
    "rapid": "  ! {}\n",
    "scl": "      // {}\n",
    "st": "    (* {} *)\n",
    "urscript": "# {}\n",
    "c": " *     {}\n",
    "python": "# {}\n",
}
"""Language -> a remark beside the address."""
_BESIDE_THE_GATEWAY: Final = ("c", "python")
"""Languages of programs that may run on the gateway's machine."""


class UnspeakableNameError(ValueError):
    """A register of the map has a name that the language cannot have; the message names all of them."""


def render_client(register_map: RegisterMap, language: str, where: Endpoint) -> str:
    """Return the client's whole text. Raises MissingRegisterError, UnspeakableNameError, ValueError for an unknown
    language."""
    if language not in TEMPLATES:
        raise ValueError(f"{language} is not one of {', '.join(LANGUAGES)}")
    table = ExchangeTable(register_map, where)
    _check_names(register_map, unspeakable(table, language))
    text = files("gateway.clients").joinpath("templates", TEMPLATES[language]).read_text("utf-8")
    remarks = [*where.to_fill_in(from_elsewhere=language not in _BESIDE_THE_GATEWAY), *where.cautions]
    if language == "scl" and where.s7_port_fault:
        remarks.append(f"FILL IN another port: {where.s7_port_fault}")
    fill_in = "".join(map(_REMARKS[language].format, remarks))
    client = Template(text).substitute({**table.values(), **SPELLINGS[language](table), "fill_in": fill_in})
    _check_names(register_map, doubled(client, language))
    return client


def _check_names(register_map: RegisterMap, odd: Iterator[str]) -> None:
    if found := list(odd):
        raise UnspeakableNameError(f"map {register_map.name}: {'; '.join(found)}: give it another name")


def endpoint_of(rig: Rig | None) -> Endpoint:
    """Return where a rig's gateway listens: its plain TCP face; the defaults without a rig."""
    if rig is None:
        return Endpoint(defaults.HOST, defaults.MODBUS_PORT, defaults.UNIT_ID)
    units = rig.network.units
    unit = defaults.UNIT_ID if defaults.UNIT_ID in units else units[0]
    return Endpoint(rig.network.bind, rig.network.port, unit, tuple(_cautions(rig)))


def _cautions(rig: Rig) -> Iterator[str]:
    """Yield where this rig lets a client do less than its head says, or a force outlast it."""
    supervision = rig.control.supervision
    if not rig.network.plain:
        yield "This rig has no plain Modbus TCP: this client cannot connect."
    if supervision.lease_s is None:
        yield "This rig has no lease: a force outlasts this program. Set lease_s."
    elif supervision.lease_action is LeaseAction.HOLD:
        yield "This rig's lease_action is hold: a force outlasts this program."
    if is_no_address(rig.network.owner):
        yield "This rig's owner is no address: from here one may read, and disable."


def is_no_address(owner: str | None) -> bool:
    """Return whether this owner of the setpoint is named, and no master on plain Modbus TCP: a serial face, a certificate."""
    if owner is None:
        return False
    try:
        ip_address(owner)
    except ValueError:
        return True
    return False
