"""`upload` over a serial line that loses requests and answers: each is repeated that may be, and a commit is done once."""

from collections.abc import Callable
from pathlib import Path

import pytest
from pymodbus.client import ModbusSerialClient
from pymodbus.exceptions import ModbusIOException

from gateway.calibrations.store import as_text
from tests.calibrations.coefficients import calibration
from tests.cli.master.test_upload import Gateway
from tests.disk.threads import join_disk_threads


class Noise:
    """Loses what it is told to: (number of the write, "request" or "answer"), counted from 0 over the whole upload."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.lost: dict[int, str] = {}
        self.addresses: list[int] = []
        for name in ("write_registers", "write_register"):
            monkeypatch.setattr(ModbusSerialClient, name, self._wrap(getattr(ModbusSerialClient, name)))

    def _wrap(self, ask: Callable[..., object]) -> Callable[..., object]:
        def call(client: ModbusSerialClient, address: int, *given: object, **options: object) -> object:
            lost = self.lost.get(len(self.addresses))
            self.addresses.append(address)
            if lost == "request":
                raise ModbusIOException("no response")
            answer = ask(client, address, *given, **options)
            if lost == "answer":
                raise ModbusIOException("no response")
            return answer

        return call


@pytest.fixture
def noise(monkeypatch: pytest.MonkeyPatch) -> Noise:
    return Noise(monkeypatch)


@pytest.fixture
def gateway(tmp_path: Path, register_map) -> Gateway:
    return Gateway(tmp_path / "state", register_map)


@pytest.fixture
def line(gateway, serve):
    server = serve(gateway.bank)
    yield ("--rtu", server.serial_path, "--baud", "115200", "--unit", "3")
    gateway.upload.close()
    join_disk_threads()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.yaml"
    path.write_text(as_text(calibration(16)), encoding="utf-8")
    return path


@pytest.mark.sampled
@pytest.mark.parametrize("what", ["request", "answer"])
@pytest.mark.parametrize("number", range(5))
def test_one_lost_frame_costs_one_repetition(gateway, line, call, file, noise, number, what) -> None:
    noise.lost = {number: what}
    done = call("upload", file, "--slot", 2, *line)
    assert done.exit_code == 0, done.output
    assert "is in use as calibration 2, slot 2" in done.output
    is_commit_heard = number == 4 and what == "answer"
    assert len(noise.addresses) == (5 if is_commit_heard else 6)
    assert noise.addresses.count(1145) == 1 + (number == 4 and what == "request")
    assert [entry.number for entry in gateway.store.list()] == [2]


def test_a_commit_of_the_set_in_use_whose_answer_is_lost_is_known_by_the_active_block(line, call, file, noise) -> None:
    """commit_status is committed before and after: only the set in use tells."""
    assert call("upload", file, "--slot", 2, *line).exit_code == 0
    noise.addresses.clear()
    noise.lost = {4: "answer"}
    done = call("upload", file, "--slot", 2, *line)
    assert done.exit_code == 0 and "the gateway knew it" in done.output
    assert noise.addresses.count(1145) == 1


def test_a_commit_that_was_not_heard_after_an_earlier_upload_is_sent_again(
    gateway, line, call, file, tmp_path, noise
) -> None:
    assert call("upload", file, "--slot", 2, *line).exit_code == 0
    other = tmp_path / "other.yaml"
    other.write_text(as_text(calibration(12)), encoding="utf-8")
    noise.addresses.clear()
    noise.lost = {4: "request", 5: "request"}
    done = call("upload", other, "--slot", 3, *line)
    assert done.exit_code == 0 and "is in use as calibration 3, slot 3" in done.output
    assert noise.addresses.count(1145) == 3


def test_a_line_that_stays_silent_is_told_as_one_that_answered_before(gateway, line, call, file, noise) -> None:
    noise.lost = dict.fromkeys(range(1, 50), "request")
    done = call("upload", file, *line)
    assert done.exit_code == 69
    assert done.stderr.startswith("E123 ") and "though it answered before: noise" in done.stderr
    assert "Are A and B swapped?" not in done.stderr and "--baud" not in done.stderr
    assert len(noise.addresses) == 5, "the first write, then one that was tried four times"
    assert gateway.store.list() == []


@pytest.mark.parametrize("dry", [(), ("--dry-run",)])
def test_a_commit_that_is_never_heard_is_told_and_no_check_has_passed(
    gateway, line, call, file, noise, dry: tuple[str, ...]
) -> None:
    noise.lost = dict.fromkeys(range(4, 50), "request")
    done = call("upload", file, *dry, *line)
    assert done.exit_code == 69 and done.stderr.startswith("E123 "), done.output
    assert noise.addresses.count(1145) == 4 and gateway.store.list() == []


def test_a_write_of_a_command_is_never_repeated(line, call, noise) -> None:
    noise.lost = {0: "answer"}
    done = call("write", "force_setpoint=12", *line)
    assert done.exit_code == 69 and noise.addresses == [1]
