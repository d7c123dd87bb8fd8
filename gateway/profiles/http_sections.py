"""What a rig file says of the faces for people and their tools: the page (`web`), its metrics (`metrics`), OPC UA (`opcua`).

A token must not travel with recordings, which carry the rig's texts, nor be shown: `without_secrets` blanks it there.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Final, Protocol

import yaml
from annotated_types import MaxLen, MinLen
from pydantic import AfterValidator, BeforeValidator

from gateway import defaults
from gateway.defaults import STRICT
from gateway.profiles.rigs.addresses import Address
from gateway.profiles.strict_yaml.typed import adapter
from gateway.profiles.telemetry_sections import Mqtt

_SECRETS: Final = ("token", "password")
_SPELT: Final = re.compile(r"\\[xu\r\n\x85\u2028\u2029]", re.I)
"""By what a key in double quotes may be hidden: an escape, "to\\u006ben", or the end of its line. The "\\r\\n" of a device's
sentences spells nothing."""
_COMMENT: Final = re.compile(r"(?:^|(?<=\s))#[^\n]*", re.M)
_SAID: Final = re.compile(rf"(?:{'|'.join(_SECRETS)})[\"']?\s*[:=]\s*(\S.*)", re.I)
_LEAST: Final = 8  # characters of a secret that is looked for in comments: a shorter one stands in any word
_NULL: Final = "tag:yaml.org,2002:null"
_LAST_PORT: Final = 65535
_OPCUA_PORT: Final = 4840  # IANA's for OPC UA
_BLANK: Final = "removed-from-this-copy"


def _refuse_bare_port(value: object) -> object:
    """Propose the address for a port alone, also in quotes and as `:8080`: the proposal must be one that is taken."""
    port = str(value).removeprefix(":")
    if port.isdecimal() and int(port) <= _LAST_PORT:
        raise ValueError(f"{value} is a port alone: write {defaults.HOST}:{port}")
    return value


def _check_listen(text: str) -> str:
    host, port = split_listen(text)
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def split_listen(text: str) -> tuple[str, int]:
    """Return HOST:PORT or [IPV6]:PORT as (host, port); ValueError for anything else."""
    host, _, port = text.rpartition(":")
    if not port.isdecimal() or int(port) > _LAST_PORT or (":" in host and not host.startswith("[")):
        raise ValueError(f'"{text}" is not HOST:PORT such as {defaults.HOST}:{defaults.WEB_PORT}')
    bare: Any = host.removeprefix("[").removesuffix("]")
    address: str = adapter(Address).validate_python(bare)
    return address, int(port)


Listen = Annotated[str, AfterValidator(_check_listen), BeforeValidator(_refuse_bare_port)]


def _refuse_any_port(value: object) -> object:
    """Propose no port 0 in the place of a 0 alone, as elsewhere: it is refused here."""
    if str(value).removeprefix(":") == "0":
        raise ValueError(f"{value} is no port that a client could know: write {defaults.HOST}:{_OPCUA_PORT}")
    return value


def _check_fixed_port(listen: str) -> str:
    if split_listen(listen)[1] == 0:
        raise ValueError(f'"{listen}" has no port that a client could know; {_OPCUA_PORT} is usual')
    return listen


Token = Annotated[str, MinLen(16), MaxLen(200)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Web:
    """The page in the browser."""

    __pydantic_config__ = STRICT
    listen: Listen = (
        f"{defaults.HOST}:{defaults.WEB_PORT}"  # HOST:PORT; port 0: any free one; beyond loopback it needs `token`
    )
    token: Token | None = None  # what a browser must know, at least 16 characters; keep this file from others then


@dataclass(frozen=True, slots=True, kw_only=True)
class Metrics:
    """The gateway's figures for Prometheus, read only."""

    __pydantic_config__ = STRICT
    listen: Listen = (
        f"{defaults.HOST}:{defaults.METRICS_PORT}"  # HOST:PORT of http://HOST:PORT/metrics; port 0: any free one
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class OpcUa:
    """The gateway's figures for clients of OPC UA, read only."""

    __pydantic_config__ = STRICT
    listen: Annotated[Listen, BeforeValidator(_refuse_any_port), AfterValidator(_check_fixed_port)] = (
        f"{defaults.HOST}:{_OPCUA_PORT}"  # HOST:PORT of opc.tcp://HOST:PORT/
    )


class HttpSections(Protocol):
    """A rig file, as far as this page is concerned."""

    @property
    def web(self) -> Web | None:
        """Section `web`."""

    @property
    def metrics(self) -> Metrics | None:
        """Section `metrics`."""

    @property
    def mqtt(self) -> Mqtt | None:
        """Section `mqtt`."""

    @property
    def opcua(self) -> OpcUa | None:
        """Section `opcua`."""


def http_sections_of(file: HttpSections) -> dict[str, Any]:
    """Return the sections of a rig file by their names in a Rig."""
    return {"web": file.web, "metrics": file.metrics, "mqtt": file.mqtt, "opcua": file.opcua}


def without_secrets(text: str) -> str:
    """Return the text of a rig file with tokens and passwords blanked; it reads as before otherwise. Where a value ends YAML
    says: it may have spaces, commas and number signs in it, and go on in the next line. One in a comment, as of a former token,
    goes to the end of its line; a comment that has the present one goes as a whole."""
    if not (_SPELT.search(text) or any(name in text.lower() for name in _SECRETS)):
        return text
    document = yaml.compose(text, yaml.SafeLoader)
    nodes = list(_secret_nodes(document))
    places = [(node.start_mark.index, node.end_mark.index) for node in nodes]
    places += _places_in_comments(text, document, [node.value for node in nodes if len(node.value) >= _LEAST])
    for first, end in sorted(places, reverse=True):
        text = text[:first] + _BLANK + text[first + len(text[first:end].rstrip()) :]
    return text


def _secret_nodes(node: yaml.Node | None) -> Iterator[yaml.ScalarNode]:
    """Yield the values of secrets."""
    if isinstance(node, yaml.SequenceNode):
        for item in node.value:
            yield from _secret_nodes(item)
    for key, value in node.value if isinstance(node, yaml.MappingNode) else ():
        if key.value in _SECRETS and isinstance(value, yaml.ScalarNode) and value.tag != _NULL:
            yield value
        else:
            yield from _secret_nodes(value)


def _places_in_comments(text: str, document: yaml.Node | None, secrets: Sequence[str]) -> Iterator[tuple[int, int]]:
    values, at = list(_value_places(document)), 0
    while comment := _COMMENT.search(text, at):
        at = comment.end()
        if inside := next((end for first, end in values if first <= comment.start() < end), 0):
            at = inside  # a number sign in a value begins no comment
        elif any(secret in comment[0] for secret in secrets):
            yield comment.start() + 1, comment.end()
        elif said := _SAID.search(comment[0]):
            yield comment.start() + said.start(1), comment.end()


def _value_places(node: yaml.Node | None) -> Iterator[tuple[int, int]]:
    if isinstance(node, yaml.ScalarNode):
        yield node.start_mark.index, node.end_mark.index
    elif node is not None:
        for each in node.value:
            for part in each if isinstance(each, tuple) else (each,):
                yield from _value_places(part)
