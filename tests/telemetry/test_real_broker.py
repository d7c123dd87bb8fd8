"""Against Debian's mosquitto: a birth, data, the death of a killed process, and a broker that dies and comes back."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import paho.mqtt.client as paho
import pytest
from click.testing import CliRunner

from gateway.cli.main import command
from gateway.profiles import shipped_profiles_folder
from tests.telemetry.readings import holding
from tests.telemetry.sparkplug_schema import Payload, decoded, values

MOSQUITTO = shutil.which("mosquitto") or "/usr/sbin/mosquitto"
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        not Path(MOSQUITTO).exists(),
        reason="no mosquitto here (apt-get install mosquitto): MQTT IS NOT TRIED AGAINST A BROKER",
    ),
]


class FakeControl:
    """Answers `state` with a force that is one more each time."""

    def __init__(self, path: Path) -> None:
        self.force_n = 0.0
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(str(path))
        self._listener.listen()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        connection, _ = self._listener.accept()
        with connection, connection.makefile("rwb") as stream:
            for _ in stream:
                self.force_n += 1.0
                answer = holding().to_json() | {"ok": True}
                answer["force"] = answer["force"] | {"measured_n": self.force_n}
                stream.write(json.dumps(answer).encode() + b"\n")
                stream.flush()

    def close(self) -> None:
        self._thread.join(10)
        self._listener.close()


class Listener:
    """What a subscriber to everything has heard: (topic, payload, retained)."""

    def __init__(self, port: int) -> None:
        self.heard: list[tuple[str, bytes, bool]] = []
        self.client = paho.Client(paho.CallbackAPIVersion.VERSION2)
        subscribed = threading.Event()
        self.client.on_connect = lambda client, *_: client.subscribe("#", qos=1)
        self.client.on_subscribe = lambda *_: subscribed.set()
        self.client.on_message = lambda _, __, message: self.heard.append(
            (message.topic, message.payload, message.retain)
        )
        self.client.connect("127.0.0.1", port)
        self.client.loop_start()
        assert subscribed.wait(10)

    def of(self, kind: str) -> list[bytes]:
        return [payload for topic, payload, _ in self.heard if kind in topic]

    def wait(self, kind: str, count: int = 1) -> list[bytes]:
        until(lambda: len(self.of(kind)) >= count, f"{count} x {kind}, heard {[one[0] for one in self.heard]}")
        return self.of(kind)

    def close(self) -> None:
        self.client.disconnect()
        self.client.loop_stop()


def until(condition: Callable[[], bool], what: str, within_s: float = 15.0) -> None:
    deadline_s = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < deadline_s, f"not within {within_s} s: {what}"
        time.sleep(0.01)


def start_broker(folder: Path, port: int, *settings: str) -> "subprocess.Popen[bytes]":
    file = folder / "mosquitto.conf"
    file.write_text("\n".join([f"listener {port} 127.0.0.1", "allow_anonymous true", *settings, ""]))
    broker = subprocess.Popen([MOSQUITTO, "-c", str(file)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    until(lambda: answers(port), "mosquitto listens")
    return broker


def answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def kill(process: "subprocess.Popen[Any]") -> None:
    process.send_signal(signal.SIGKILL)
    process.wait(10)


@pytest.fixture
def port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def control(tmp_path: Path) -> Iterator[FakeControl]:
    control = FakeControl(tmp_path / "control.sock")
    yield control
    control.close()


@pytest.fixture
def client(control: FakeControl, tmp_path: Path, port: int) -> Iterator["subprocess.Popen[bytes]"]:
    """The MQTT process, without a guardian; the broker is not there yet."""
    with run_client(
        tmp_path, f"{{host: 127.0.0.1, port: {port}, commands: true, sparkplug: {{group: plant}}}}"
    ) as process:
        yield process


@contextmanager
def run_client(tmp_path: Path, section: str) -> Iterator["subprocess.Popen[bytes]"]:
    rig = tmp_path / "rig.yaml"
    text = (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text(encoding="utf-8")
    rig.write_text(f"{text}mqtt: {section}\n", encoding="utf-8")
    guardian, link = socket.socketpair()
    os.set_inheritable(link.fileno(), True)
    options = json.dumps({"rig": str(rig), "state": str(tmp_path), "simulated": True, "fingerprint": None})
    command = [sys.executable, "-m", "gateway.telemetry.mqtt_process", str(link.fileno()), options]
    with guardian, link:
        process = subprocess.Popen(command, pass_fds=[link.fileno()])
        yield process
        kill(process)


def test_birth_data_rebirth_death_and_a_broker_that_dies_and_returns(
    client: "subprocess.Popen[bytes]", control: FakeControl, tmp_path: Path, port: int
) -> None:
    broker = start_broker(tmp_path, port)
    listener = Listener(port)
    try:
        birth = listener.wait("NBIRTH")[0]
        assert decoded(birth).seq == 0
        listener.wait("NDATA", 5)
        assert [decoded(data).seq for data in listener.of("NDATA")][:5] == [1, 2, 3, 4, 5]
        rebirth = Payload(timestamp=1)
        rebirth.metrics.add(name="Node Control/Rebirth", datatype=11, boolean_value=True)
        listener.client.publish("spBv1.0/plant/NCMD/demo", rebirth.SerializeToString())
        again = listener.wait("NBIRTH", 2)[1]
        assert decoded(again).seq == 0 and values(again)["bdSeq"] == values(birth)["bdSeq"]
    finally:
        listener.close()
        kill(broker)
    told_n = max(forces(listener))

    until(lambda: control.force_n >= told_n + 10, "looks while the broker is away")
    client.send_signal(signal.SIGSTOP)  # so that the listener is there first
    broker = start_broker(tmp_path, port)
    listener = Listener(port)
    client.send_signal(signal.SIGCONT)
    try:
        back = listener.wait("NBIRTH")[0]
        assert decoded(back).seq == 0 and values(back)["bdSeq"] > values(birth)["bdSeq"]
        listener.wait("NDATA", 15)
        stored = [one for one in map(decoded, listener.of("NDATA")) if one.metrics[0].is_historical]
        assert len(stored) >= 10 and all(metric.is_historical for one in stored for metric in one.metrics)
        later = forces(listener)
        assert later == sorted(set(later)), "in order, each once"
        assert set(range(int(told_n) + 2, int(told_n) + 10)) <= set(later), "nothing of while it was away is missing"
        assert not decoded(listener.of("NDATA")[-1]).metrics[0].is_historical

        kill(client)
        assert values(listener.wait("NDEATH")[-1]) == {"bdSeq": values(back)["bdSeq"]}
        until(lambda: listener.of("online")[-1:] == [b"false"], "offline by the will")
    finally:
        listener.close()
        kill(broker)


def test_a_command_of_yesterday_that_the_broker_kept_is_not_carried_out(
    client: "subprocess.Popen[bytes]", tmp_path: Path, port: int
) -> None:
    client.send_signal(signal.SIGSTOP)  # so that the command is there first
    broker = start_broker(tmp_path, port)
    listener = Listener(port)
    try:
        listener.client.publish("force-gateway/demo/command", b'{"control_word": 1}', qos=1, retain=True)
        listener.wait("demo/command")
        client.send_signal(signal.SIGCONT)
        listener.wait("demo/force", 3)
        listener.client.publish("force-gateway/demo/command", b'{"no_such_register": 1}', qos=1)
        (result,) = listener.wait("command/result")
        assert "no_such_register" in json.loads(result)["error"]
    finally:
        listener.close()
        kill(broker)


def test_tls_with_certificates_on_both_sides_and_none_to_a_stranger(
    control: FakeControl, tmp_path: Path, port: int
) -> None:
    ours, strange = tmp_path / "ours", tmp_path / "strange"
    for folder in (ours, strange):
        assert (
            CliRunner()
            .invoke(command, ["certs", str(folder), "--host", "127.0.0.1", "--client", "cell:monitor"])
            .exit_code
            == 0
        )
    named = ours / "gateway.crt", ours / "gateway.key"
    broker = start_broker(
        tmp_path,
        port,
        f"cafile {ours}/ca.crt",
        f"certfile {named[0]}",
        f"keyfile {named[1]}",
        "require_certificate true",
        "use_identity_as_username true",
        f"log_dest file {tmp_path}/broker.log",
        "user root",
    )

    def tls(ca: Path, client: Path) -> str:
        files = f"{{ca: {ca}/ca.crt, certificate: {client}/cell.crt, key: {client}/cell.key}}"
        return f"{{host: 127.0.0.1, port: {port}, tls: {files}}}"

    def log() -> str:
        path = tmp_path / "broker.log"
        return path.read_text() if path.exists() else ""

    try:
        with run_client(tmp_path, tls(strange, strange)):
            until(
                lambda: "unknown ca" in log().lower() or "certificate verify failed" in log().lower(),
                "a refused handshake",
            )
        assert "force-gateway" not in log()
        with run_client(tmp_path, tls(ours, ours)):
            until(lambda: "as force-gateway force-gateway/demo" in log(), "the gateway is let in")
    finally:
        kill(broker)


def forces(listener: Listener) -> list[float]:
    told = map(values, listener.of("NDATA"))
    return [one["Force/Measured N"] for one in told if "Force/Measured N" in one]
