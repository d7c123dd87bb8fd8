"""Where the gateway listens, who may connect and who may command: what holds whatever the master is."""

from collections.abc import Iterator
from ipaddress import ip_address
from typing import Final

from gateway import defaults
from gateway.clients.exchange import ExchangeTable
from gateway.clients.rendering import is_no_address
from gateway.clients.wiring.section import Section
from gateway.control.settings import LeaseAction
from gateway.profiles import Rig
from gateway.registers.map.register_map import holding_number

_LOST: Final = {
    LeaseAction.FAULT: "the safe voltage, and fault A310",
    LeaseAction.HOLD: "a warning, and the force is kept (hold)",
    LeaseAction.RAMP: "along the ramp to 0 N, and off",
}
"""What happens at the end of the lease."""
_IPV4: Final = 4


def network_section(rig: Rig, table: ExchangeTable) -> Section:
    """Return where masters find the gateway, and what a client of one's own must keep to."""
    network, where, lease_s = rig.network, table.where, rig.control.supervision.lease_s
    allowed = ", ".join(map(str, network.allow)) or "nobody but this machine"
    upload = "allowed" if network.allow_plain_upload else "refused on plain TCP (W211): allow_plain_upload"
    plain = (
        ("address", f"{where.shown}, TCP"),
        ("unit ids", ", ".join(map(str, network.units))),
        ("may connect", allowed),
        ("upload of models", upload),
    )
    rows = (
        ("what", "value"),
        *(plain if network.plain else ()),
        ("owner", network.owner or "the first master that commands, until it lets go"),
        (
            "lease",
            "none: a command lasts until the next one"
            if lease_s is None
            else f"{lease_s:g} s without a new heartbeat, then {_LOST[rig.control.supervision.lease_action]}",
        ),
        (
            "byte order",
            "echo of 1234.5 is demanded before enable" if network.require_byte_order_echo else "ABCD, not demanded",
        ),
    )
    return Section("Network: Modbus TCP", _sentences(rig, table), rows)


def _sentences(rig: Rig, table: ExchangeTable) -> tuple[str, ...]:
    network, where = rig.network, table.where
    sentences = ["Ethernet cable to the robot's or PLC's network (IRC5: WAN, LAN or service port)."]
    if not network.plain:
        off = "Plain Modbus TCP is off in this rig (network.plain: false): masters use the faces above"
        sentences = [f"{off}. The generated clients and mbpoll by TCP cannot connect. What follows holds on each face."]
    elif ip_address(network.bind).is_loopback:
        sentences.append(
            f"This rig listens on {network.bind} only: no robot can reach it. Set network.bind to this machine's address on "
            "the cell's network, and network.allow to the networks that may connect."
        )
    if network.plain and ip_address(network.bind).version > _IPV4 and not ip_address(network.bind).is_loopback:
        sentences.append(
            f"{network.bind} is an IPv6 address, and what follows for robots and PLCs knows IPv4 alone: set network.bind and "
            "network.allow to this machine's IPv4 address and network. Other programs may use IPv6."
        )
    if network.plain and not where.port:
        sentences.append(
            f"network.port is 0: the gateway takes a free port at each start, {where.shown_port} below, and its banner says "
            "which. A robot or PLC needs one that stays: set network.port (502 is Modbus' own)."
        )
    sentences += _rights(rig)
    values = table.command_span[0] + table.values_first
    generated = " The generated clients do so." if network.plain else ""
    sentences.append(
        "A program of your own that writes control_word in each cycle, enable in it, undoes another master's stop: write it "
        f"only when you want it changed, else from address {values} ({holding_number(values)}) on.{generated}"
    )
    if network.require_byte_order_echo:
        echo = table.map.find("byte_order_echo").address
        sentences.append(
            f"Before the first enable write 1234.5 to byte_order_echo: words 16#449A, 16#5000 to address {echo} "
            f"({holding_number(echo)}), once a connection.{generated}"
        )
    return tuple(sentences)


def _rights(rig: Rig) -> Iterator[str]:
    """Yield who may not command, and whose force outlasts it."""
    supervision, owner = rig.control.supervision, rig.network.owner
    if supervision.lease_s is None:
        yield (
            "This rig has no lease: the force lasts when the master's program stops or its cable is pulled. Before a robot or "
            f"PLC commands it, set supervision.lease_s ({defaults.LEASE_S:g})."
        )
    elif supervision.lease_action is LeaseAction.HOLD:
        yield (
            "At the end of its lease this rig keeps the force (supervision.lease_action: hold): when a program stops "
            "or its cable is pulled. Before a robot or PLC commands it, set fault or ramp."
        )
    if is_no_address(owner):
        others = "a robot or PLC on plain Modbus TCP" if rig.network.plain else "whoever asks by another face"
        yield f"Only {owner} may command here (network.owner): {others} may read, and disable."
