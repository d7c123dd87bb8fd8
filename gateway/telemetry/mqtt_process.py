"""MQTT as a process: `python -m gateway.telemetry.mqtt_process LINK '{"rig": ..., "state": ..., "simulated": ...}'`.

One look at control's state, five times a second, feeds two connections: plain JSON topics, and a Sparkplug B edge node where
the rig has one. Each has a will of its own, and is opened again when the broker comes back. It ends with the guardian; the
broker then tells the wills.
"""

import asyncio
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gateway.live.control_link import ControlLink
from gateway.live.live_state import LiveState
from gateway.plain_file import read_plain, tell_refusal
from gateway.processes.beside_control import serve_until_guardian_ends
from gateway.processes.event_log import EventLog
from gateway.telemetry.mqtt.broker_connection import Broker, keep_connected
from gateway.telemetry.mqtt.broker_session import BrokerSession
from gateway.telemetry.mqtt.edge_node import EdgeNode
from gateway.telemetry.mqtt.json_topics import JsonTopics
from gateway.telemetry.mqtt.kept_bd_seq import KeptBdSeq
from gateway.telemetry.mqtt.register_commands import RegisterCommands

if TYPE_CHECKING:
    from gateway.profiles import Rig
LOOK_S: Final = 0.2


def make_sessions(rig: "Rig", link: ControlLink, state: Path) -> list[BrokerSession]:
    """Return what the rig wants to be told. state: its directory."""
    mqtt = rig.mqtt
    assert mqtt is not None  # or nobody had started us
    command = RegisterCommands(rig.register_map, link, rig.network.units[0]).carry_out if mqtt.commands else None
    sessions: list[BrokerSession] = [JsonTopics(mqtt.base_topic or f"force-gateway/{rig.name}", command)]
    if mqtt.sparkplug:
        kept = KeptBdSeq(state)
        node = mqtt.sparkplug.node or rig.name
        sessions.append(EdgeNode(mqtt.sparkplug.group, node, kept.next, on_connected=kept.note_connected))
    return sessions


async def look_forever(link: ControlLink, sessions: list[BrokerSession]) -> None:
    """Offer each session what control answers."""
    while True:
        began_s = time.monotonic()
        try:
            state = LiveState.from_json(await link.ask({"do": "state"}))
        except (OSError, ValueError):
            state = None
        for session in sessions:
            session.offer(state, time.time())
        await asyncio.sleep(max(0.0, LOOK_S - (time.monotonic() - began_s)))


class Announcer:
    """Says once what several connections to one broker have to say."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say, self._last = say, ""

    def say(self, text: str) -> None:
        """Say it, unless it has just been said."""
        if text != self._last:
            self._say(text)
        self._last = text


async def publish(options: dict[str, Any], log: EventLog) -> None:
    """Publish until the process ends. options: as the guardian gives them."""
    from gateway.profiles.kept_rig import rig_as_started

    rig = rig_as_started(options)
    assert rig.mqtt is not None
    password = _password_in(rig.mqtt.password_file) if rig.mqtt.password_file else None
    tls = rig.mqtt.tls
    certificates = (tls.ca, tls.certificate, tls.key) if tls else ()
    broker = Broker(rig.mqtt.host, rig.mqtt.port, rig.mqtt.username, password, *certificates)
    state = Path(options["state"])
    link = ControlLink(state)
    sessions, announcer = make_sessions(rig, link, state), Announcer(lambda text: log("broker", text))
    async with asyncio.TaskGroup() as group:
        group.create_task(look_forever(link, sessions))
        for session in sessions:
            group.create_task(keep_connected(broker, session, announcer.say))


def _password_in(file: str) -> str:
    """Return the password. OSError with a sentence where the file does not give one."""
    try:
        return read_plain(file).decode().strip()
    except UnicodeDecodeError:
        raise OSError(f"E181 mqtt.password_file {file} is no text in UTF-8: save it so") from None
    except OSError as error:
        raise OSError(f"E181 mqtt.password_file {file}: {tell_refusal(error)}") from None


def main(arguments: list[str]) -> int:
    """Serve until the guardian ends. arguments: descriptor of the link, options as JSON."""
    return serve_until_guardian_ends("mqtt", arguments, publish)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
