"""Addresses, networks and owners as a rig file writes them."""

from ipaddress import IPv4Network, IPv6Network, ip_address, ip_network
from typing import Annotated, Any

from pydantic import AfterValidator, PlainValidator, WithJsonSchema

from gateway.registers.writes.ownership import serial_place


def _address(text: str) -> str:
    try:
        return "127.0.0.1" if text == "localhost" else str(ip_address(text))
    except ValueError:
        raise ValueError(f'"{text}" is not an IP address such as 127.0.0.1 or 192.168.125.10') from None


def _bind(text: str) -> str:
    try:
        return _address(text)
    except ValueError as error:
        host, port = _split_port(text)
        cure = f"; the port has a key of its own: bind: {host} and port: {port}" if port else ""
        raise ValueError(f"{error}{cure}") from None


def _owner(text: str) -> str:
    if serial_place(text) is not None or is_certificate(text):
        return text
    try:
        return _as_peer(_address(text))
    except ValueError as error:
        host, port = _split_port(text)
        cure = f"; an owner has no port: write {host}" if port else ""
        raise ValueError(f"{error}, nor a serial face such as serial:1, nor certificate NAME{cure}") from None


def _split_port(text: str) -> tuple[str, str]:
    """Return address and port of ADDRESS:PORT or [IPV6]:PORT; empty ones of anything else."""
    host, _, port = text.rpartition(":")
    host = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    try:
        return (_address(host), port) if port.isdecimal() else ("", "")
    except ValueError:
        return "", ""


def _as_peer(text: str) -> str:
    """Return an address as a connection from it is known by: without a scope, and by IPv4 where it is one of those."""
    address = ip_address(text.partition("%")[0])
    return str(getattr(address, "ipv4_mapped", None) or address)


def is_certificate(owner: str) -> bool:
    """Return whether an owner is named by its certificate: `certificate NAME`, as the gateway tells of it."""
    return bool(owner.removeprefix("certificate ").strip()) and owner.startswith("certificate ")


def _network(text: Any) -> IPv4Network | IPv6Network:
    if not isinstance(text, str):
        raise ValueError(f"{text} is not a network such as 192.168.125.0/24")
    try:
        return ip_network(text)
    except ValueError:
        raise ValueError(f'"{text}" is not a network such as 192.168.125.0/24{_suggest_network(text)}') from None


def _suggest_network(text: str) -> str:
    """Return the network that the address is in, as a suggestion: host bits set are the usual slip."""
    try:
        return f"; did you mean {ip_network(text, strict=False)}?"
    except ValueError:
        return ""


Address = Annotated[str, AfterValidator(_address)]
BindAddress = Annotated[str, AfterValidator(_bind)]
"""Of a section that has a key `port` beside it."""
Owner = Annotated[str, AfterValidator(_owner)]
Network4Or6 = Annotated[
    IPv4Network | IPv6Network,
    PlainValidator(_network, json_schema_input_type=str),
    WithJsonSchema({"type": "string", "examples": ["192.168.125.0/24"]}),
]
