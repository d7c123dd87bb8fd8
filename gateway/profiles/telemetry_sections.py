"""What a rig file says of telemetry that it sends by itself: MQTT (`mqtt`)."""

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Le, MinLen
from pydantic import Field

from gateway.defaults import STRICT

Name = Annotated[str, Field(pattern=r"^[^/#+\x00]{1,100}$")]
Topic = Annotated[str, Field(pattern=r"^[^/#+\x00][^#+\x00]{0,199}$")]
AbsolutePath = Annotated[str, Field(pattern=r"^/")]


@dataclass(frozen=True, slots=True, kw_only=True)
class SparkplugNode:
    """A Sparkplug B edge node."""

    __pydantic_config__ = STRICT
    group: Name  # group id
    node: Name | None = None  # edge node id; null: the rig's name


@dataclass(frozen=True, slots=True, kw_only=True)
class BrokerTls:
    """By which certificates the broker is known, and the gateway to it; whole paths of PEM files."""

    __pydantic_config__ = STRICT
    ca: AbsolutePath  # who signed the broker's certificate
    certificate: AbsolutePath | None = None  # the gateway's own, where the broker asks for one
    key: AbsolutePath | None = None  # of that certificate

    def __post_init__(self) -> None:
        if self.key and not self.certificate:
            raise ValueError("key without certificate: nothing would be shown to the broker; name both, or neither")


@dataclass(frozen=True, slots=True, kw_only=True)
class Mqtt:
    """Figures for an MQTT broker."""

    __pydantic_config__ = STRICT
    host: Annotated[str, Field(pattern=r"^([^/:\s]+|[0-9A-Fa-f:.]+)$")]  # name or address of the broker
    port: Annotated[int, Ge(1), Le(65535)] = 1883  # with tls usually 8883
    tls: BrokerTls | None = None  # null: no TLS
    username: Annotated[str, MinLen(1)] | None = None
    password_file: AbsolutePath | None = None  # whole path of a file that holds the password and nothing else
    base_topic: Topic | None = None  # of the JSON topics; null: force-gateway/NAME of the rig
    sparkplug: SparkplugNode | None = None  # null: JSON topics only
    commands: bool = False  # true: who may publish to BASE/command may command the force, by the rules of any master
