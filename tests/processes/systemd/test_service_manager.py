"""What systemd hears: by a socket of our own in its place."""

import os
import socket
from collections.abc import Iterator
from math import inf
from pathlib import Path
from threading import Thread

import pytest

from gateway.processes.systemd.service_manager import ServiceManager, take_service_manager


class Heard:
    """Datagrams as systemd would read them."""

    def __init__(self, path: Path) -> None:
        self.address = str(path)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(self.address)
        self._socket.setblocking(False)

    def all(self) -> list[dict[str, str]]:
        found = []
        while True:
            try:
                text = self._socket.recv(4096).decode()
            except BlockingIOError:
                return found
            found.append(dict(line.split("=", 1) for line in text.splitlines()))

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def systemd(tmp_path: Path) -> Iterator[Heard]:
    heard = Heard(tmp_path / "notify")
    yield heard
    heard.close()


def test_the_watchdog_hears_of_heartbeats_only_and_of_each_third_of_its_time(systemd: Heard) -> None:
    manager = ServiceManager(systemd.address, 9.0)
    for beat in range(1000):
        manager.feed(100.0 + 0.01 * beat)
    assert systemd.all() == [{"WATCHDOG": "1"}] * 4, "at 0, 3, 6 and 9 s of ten"
    manager.feed(109.5)
    manager.feed(109.5)
    assert systemd.all() == [], "a heartbeat that was passed on is not passed on again, however often it is asked"


def test_a_start_asks_for_its_time_and_ready_takes_it_back(systemd: Heard) -> None:
    manager = ServiceManager(systemd.address, 10.0)
    manager.starting("control is started again: it died", 60.0)
    manager.ready("rig demo")
    manager.stopping()
    start, ready, stop = systemd.all()
    assert (start["WATCHDOG_USEC"], start["STATUS"]) == ("60000000", "control is started again: it died")
    assert start["WATCHDOG"] == "1", "its time begins now"
    assert ready == {"READY": "1", "STATUS": "rig demo", "WATCHDOG_USEC": "10000000"}
    assert stop["STOPPING"] == "1"


def test_without_a_manager_or_with_one_that_is_gone_nothing_happens(systemd: Heard, tmp_path: Path) -> None:
    for silent in (ServiceManager(), ServiceManager(str(tmp_path / "nobody"), 1.0)):
        silent.ready("rig demo")
        silent.feed(1.0)
    assert systemd.all() == []


def test_children_do_not_inherit_the_service(systemd: Heard) -> None:
    environment = {"NOTIFY_SOCKET": systemd.address, "WATCHDOG_USEC": "6000000", "WATCHDOG_PID": "42", "HOME": "/x"}
    take_service_manager(environment, 42).feed(1.0)
    assert environment == {"HOME": "/x"}
    assert systemd.all() == [{"WATCHDOG": "1"}]


def test_a_watchdog_that_is_meant_for_another_process_is_not_fed(systemd: Heard) -> None:
    manager = take_service_manager(
        {"NOTIFY_SOCKET": systemd.address, "WATCHDOG_USEC": "6000000", "WATCHDOG_PID": "7"}, 42
    )
    manager.feed(1.0)
    assert systemd.all() == []


def test_a_watchdog_of_whoever_is_started_is_fed_and_one_of_no_time_is_none() -> None:
    """WATCHDOG_PID is not everybody's who starts services (sd_watchdog_enabled(3))."""
    assert take_service_manager({"WATCHDOG_USEC": "6000000"}, 42).feed_every_s == 2.0
    assert take_service_manager({"WATCHDOG_USEC": "0"}, 42).feed_every_s == inf


def test_a_manager_without_a_file_is_found_and_one_that_reads_nothing_is_not_waited_for() -> None:
    """sd_notify(3): `@` is an abstract address. The guardian must not stand for it: nobody would write the safe voltage."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(f"\0force-gateway-test-{os.getpid()}")
        manager = ServiceManager(f"@force-gateway-test-{os.getpid()}")
        saying = Thread(target=lambda: [manager.stopping() for _ in range(600)], daemon=True)
        saying.start()
        saying.join(5.0)
        assert not saying.is_alive()
        assert b"STOPPING=1" in systemd.recv(4096, socket.MSG_DONTWAIT)


def test_a_start_has_never_less_time_than_the_unit_gives(systemd: Heard) -> None:
    """WatchdogSec of two minutes, and a start that needs one: cut down to it, a slow machine would be restarted for ever."""
    manager = ServiceManager(systemd.address, 120.0)
    manager.starting("control is started again: it died", 60.0)
    manager.starting("control is started again: it died", 180.0)
    assert [int(words["WATCHDOG_USEC"]) for words in systemd.all()] == [120_000_000, 180_000_000]
