"""What is plugged in, from made-up /dev, /sys and /proc trees: this machine may have no port at all."""

import os
from pathlib import Path

import pytest

from gateway.ports import Pty, holders, holders_of, list_ports
from gateway.ports.latency import latency_ms, set_low_latency
from gateway.ports.listing import present_paths


def plug_in(root: Path, name: str, *, by_id: str | None = None, latency: str | None = None, kind: str = "4") -> None:
    usb = root / "sys" / "devices" / "usb1" / "1-1"
    device = usb / "1-1:1.0" / name
    device.mkdir(parents=True)
    (usb / "manufacturer").write_text("FTDI\n")
    (usb / "product").write_text("FT232R USB UART\n")
    driver = root / "sys" / "bus" / "ftdi_sio"
    driver.mkdir(parents=True, exist_ok=True)
    (device / "driver").symlink_to(driver)
    if latency is not None:
        (device / "latency_timer").write_text(latency)
    entry = root / "sys" / "class" / "tty" / name
    entry.mkdir(parents=True)
    (entry / "device").symlink_to(device)
    (entry / "type").write_text(kind)
    (root / "dev").mkdir(exist_ok=True)
    (root / "dev" / name).write_text("")
    if by_id:
        links = root / "dev" / "serial" / "by-id"
        links.mkdir(parents=True, exist_ok=True)
        (links / by_id).symlink_to(root / "dev" / name)


def test_a_port_is_listed_by_the_name_that_survives_a_replug(tmp_path: Path) -> None:
    plug_in(tmp_path, "ttyUSB0", by_id="usb-FTDI_A10K-if00-port0", latency="16\n")
    (info,) = list_ports(tmp_path / "dev", tmp_path / "sys")
    assert info.by_id == str(tmp_path / "dev/serial/by-id/usb-FTDI_A10K-if00-port0")
    assert info.path == info.by_id
    assert info.device == str(tmp_path / "dev/ttyUSB0")
    assert (info.description, info.driver, info.latency_ms) == ("FTDI FT232R USB UART", "ftdi_sio", 16)
    assert info.holder == ""
    assert present_paths(tmp_path / "dev", tmp_path / "sys") == [info.by_id]


def test_sockets_of_a_pc_without_a_chip_are_not_listed(tmp_path: Path) -> None:
    plug_in(tmp_path, "ttyS0", kind="0")
    (tmp_path / "sys/class/tty/tty0").mkdir(parents=True)
    assert list_ports(tmp_path / "dev", tmp_path / "sys") == []


def test_a_port_without_a_by_id_name_is_listed_by_its_device(tmp_path: Path) -> None:
    plug_in(tmp_path, "ttyAMA0")
    assert [info.path for info in list_ports(tmp_path / "dev", tmp_path / "sys")] == [str(tmp_path / "dev/ttyAMA0")]
    assert present_paths(tmp_path / "dev", tmp_path / "sys") == [str(tmp_path / "dev/ttyAMA0")]


def test_a_name_whose_adapter_is_gone_is_no_port(tmp_path: Path) -> None:
    plug_in(tmp_path, "ttyUSB0", by_id="usb-FTDI_A10K-if00-port0")
    (tmp_path / "dev/ttyUSB0").unlink()
    (tmp_path / "sys/class/tty/ttyUSB0/device").unlink()
    assert present_paths(tmp_path / "dev", tmp_path / "sys") == []
    assert list_ports(tmp_path / "dev", tmp_path / "sys") == []


def test_this_machines_ports_can_be_listed() -> None:
    assert all(info.device.startswith("/dev/") for info in list_ports())


def test_a_slow_adapter_is_made_fast(tmp_path: Path, line: Pty) -> None:
    plug_in(tmp_path, "ttyUSB0", latency="16\n")
    path = str(tmp_path / "dev/ttyUSB0")
    assert set_low_latency(line.fd, path, tmp_path / "sys") == ""
    assert latency_ms(path, tmp_path / "sys") == 1


def test_a_slow_adapter_that_stays_slow_is_told(tmp_path: Path, line: Pty, monkeypatch: pytest.MonkeyPatch) -> None:
    plug_in(tmp_path, "ttyUSB0", latency="16\n")
    monkeypatch.setattr(Path, "write_text", _denied)
    warning = set_low_latency(line.fd, str(tmp_path / "dev/ttyUSB0"), tmp_path / "sys")
    assert "every 16 ms" in warning
    assert "latency_timer" in warning


def _denied(*arguments: object) -> int:
    raise PermissionError("latency_timer")


def test_low_latency_is_asked_of_the_driver(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[int, bytes]] = []

    def driver(descriptor: int, request: int, data: bytes) -> bytes:
        data = data if asked else data[:16] + bytes((0x40, 0, 0, 0)) + data[20:]
        asked.append((request, data))
        return data

    monkeypatch.setattr("gateway.ports.latency.fcntl.ioctl", driver)
    assert set_low_latency(3, "/dev/ttyUSB9") == ""
    (_, before), (request, after) = asked
    assert request == 0x541F
    assert int.from_bytes(after[16:20], "little") == 0x40 | 1 << 13, "the other flags of the port stay"
    assert (before[:16], before[20:]) == (after[:16], after[20:])


def test_a_pty_has_no_latency_and_no_warning(line: Pty) -> None:
    assert set_low_latency(line.fd, line.path) == ""


def test_holders_are_found_and_the_locking_one_is_marked(line: Pty) -> None:
    (holder,) = holders_of(line.path)
    assert (holder.pid, holder.is_locking, str(holder)) == (os.getpid(), False, "this very process")
    assert holders_of("/dev/ttyUSB99") == []
    assert holders_of(line.path, Path("/nowhere")) == []


def test_who_locks_with_one_of_two_descriptors_locks_and_is_the_one_that_is_named(
    line: Pty, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for pid, locking in ((11, "0"), (12, "1"), (13, "")):
        for part in ("fd", "fdinfo"):
            (tmp_path / str(pid) / part).mkdir(parents=True)
        (tmp_path / str(pid) / "comm").write_text(f"p{pid}\n")
        for number in ("0", "1"):
            (tmp_path / str(pid) / "fd" / number).symlink_to(line.path)
            (tmp_path / str(pid) / "fdinfo" / number).write_text("lock:\t1: FLOCK" if number == locking else "flags: 2")
    found = holders_of(line.path, tmp_path)
    assert sorted((each.pid, each.name, each.is_locking) for each in found) == [
        (11, "p11", True), (12, "p12", True), (13, "p13", False),
    ]  # fmt: skip
    monkeypatch.setattr(holders, "holders_of", lambda path: sorted(found, key=lambda each: each.pid))
    told = holders.describe_holders("/dev/ttyUSB0")
    assert told == "/dev/ttyUSB0 is held by p11 (pid 11), p12 (pid 12); stop that one first"
