"""`upload` against the real bank: a PLC's way of a calibration, printed, tried, refused, committed and read back."""

import json
import struct
from dataclasses import replace
from pathlib import Path

import pytest

from gateway.bsfm import CoefficientLimits
from gateway.calibrations.activation import Activation, ActiveCalibration
from gateway.calibrations.store import CalibrationStore, as_text
from gateway.calibrations.upload import UploadRules, UploadService
from gateway.cli.errors import CliError
from gateway.cli.master.upload import UploadClient, place
from gateway.modbus import MbapFramer, Peer, Role, answer
from gateway.modbus.rtu import decode_adu
from gateway.processes import exit_codes
from gateway.profiles import load_calibration
from gateway.registers import BankRules, RegisterBank, RegisterMap
from gateway.registers.command import Status
from gateway.registers.upload.coefficients import CoefficientSet
from gateway.registers.words import CommitStatus
from tests.calibrations.coefficients import calibration
from tests.calibrations.failing_disk import disk
from tests.calibrations.slots import slot_number
from tests.disk.threads import join_disk_threads

OWN = calibration(8, number=1)


class Gateway:
    """Bank, store and upload service, as a cell wires them; `thread` is what the server's loop has beside it."""

    def __init__(self, state: Path, register_map: RegisterMap, **rules: object) -> None:
        given = {"rig_name": "demo", "force_max_n": 60.0} | rules
        self.bank = RegisterBank(register_map, BankRules(**given), now=lambda: 0.0)
        self.store = CalibrationStore(state, OWN)
        activation = Activation(self.store, CoefficientLimits(cell_range_n=100.0))
        self.log: list[str] = []
        self.upload = UploadService(
            self.bank.staging,
            activation,
            self.store.find_selected(),
            UploadRules.of("demo", register_map, lambda: "2026-11-22"),
            lambda cause, sentence: self.log.append(sentence),
        )
        self.upload.on_use = self._on_use
        self.bank.set_active_model(OWN)
        self.bank.publish(Status(calibration_id=1))

    def _on_use(self, taken: ActiveCalibration) -> None:
        self.bank.set_active_model(taken.calibration, taken.pointer.active.slot_word)
        self.bank.publish(Status(calibration_id=taken.calibration.number))

    def words(self, address: int, count: int) -> bytes:
        return self.bank.read_registers(address, count)


@pytest.fixture
def gateway(tmp_path: Path, register_map: RegisterMap) -> Gateway:
    return Gateway(tmp_path / "state", register_map)


@pytest.fixture
def address(gateway: Gateway, serve):
    yield serve(gateway.bank).address
    gateway.upload.close()
    join_disk_threads()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.yaml"
    stops = {"slip_radii_v": (0.25, 0.5, 1.0), "slip_shares": (0.25, 0.5, 0.25)}
    path.write_text(as_text(calibration(16, **stops)), encoding="utf-8")
    return path


@pytest.mark.sampled
@pytest.mark.parametrize("fc06", [[], ["--fc06"]])
@pytest.mark.parametrize("order", [1, 2, 15])
def test_an_upload_is_stored_used_and_read_back(gateway, address, call, tmp_path, order, fc06):
    path = tmp_path / "set.yaml"
    stops = {"slip_radii_v": (0.25, 0.5, 1.0), "slip_shares": (0.25, 0.5, 0.25)} if order == 2 else {}
    given = calibration(order, order=order, **stops)
    path.write_text(as_text(given), encoding="utf-8")
    done = call("upload", path, "--slot", 5, *fc06, "--gateway", address)
    assert done.exit_code == 0, done.output
    text = (
        f"mark {order} is in use as calibration 2, slot 5: {given.reversal_kind}, durable, and read back word by word\n"
    )
    assert done.output == text
    assert slot_number(gateway.store, 5) == 2
    assert (
        CoefficientSet.of_calibration(gateway.store.load(2)).to_words()
        == CoefficientSet.of_calibration(given).to_words()
    )


def test_a_shipped_calibration_has_a_name_only(gateway, address, call):
    done = call("upload", "demo", "--json", "--gateway", address)
    assert json.loads(done.output) == {"sent": True, "committed": True, "active": 2, "slot": 0, "known": False}
    assert gateway.store.load(2).reversal_kind == "slip, 7 stops"


def test_a_calibration_that_the_gateway_knows_keeps_its_number_and_its_name(gateway, address, call, tmp_path):
    number = gateway.store.add(load_calibration("demo"))
    gateway.upload.run_in_background = lambda work, done: done(work())
    gateway.upload.use(number)
    for options in ((), ("--fc06",)):
        done = call("upload", "demo", "--slot", 3, *options, "--gateway", address)
        assert done.output == (
            "demo is in use as calibration 2, slot 3: slip, 7 stops, durable, and read back word by word; "
            "the gateway knew it, and keeps its number and name\n"
        )
    assert [(entry.number, entry.document.name) for entry in gateway.store.list()] == [(2, "demo")]


def test_more_stops_than_the_registers_carry_are_told_before_anything_is_sent(call, tmp_path):
    path = tmp_path / "many.yaml"
    many = {"slip_radii_v": tuple(0.25 * k for k in range(1, 12)), "slip_shares": (*(0.09,) * 10, 0.1)}
    path.write_text(as_text(calibration(4, **many)), encoding="utf-8")
    done = call("upload", path, "--gateway", "127.0.0.1:9")
    assert done.exit_code == 65
    assert done.stderr.startswith("E406 mark 4 has 11 slip stops, the registers carry 10: ")


def test_a_dry_run_is_the_gateways_own(gateway, address, call, file):
    done = call("upload", file, "--dry-run", "--gateway", address)
    assert done.output == "mark 16 passes every check; nothing was stored, active set 1 unchanged\n"
    assert gateway.store.list() == []
    assert gateway.log[0].startswith("dry run by 127.0.0.1")


def test_what_the_gateway_refuses_is_told_in_words(gateway, address, call, tmp_path):
    path = tmp_path / "wide.yaml"
    wide = calibration(4, rising_handles_n=(0.0, 25.0, 120.0), falling_handles_n=(0.0, 60.0, 120.0))
    path.write_text(as_text(wide), encoding="utf-8")
    for options in ((), ("--dry-run",)):
        done = call("upload", path, *options, "--gateway", address)
        assert done.exit_code == 65
        assert done.stderr == "E401 index 2, rising handle 2: handle range; active set 1 unchanged\n"
    assert gateway.store.list() == []


def test_a_full_disk_is_the_gateways_failure(gateway, address, call, file):
    with disk(5):
        done = call("upload", file, "--gateway", address)
    assert done.exit_code == 1
    assert done.stderr == "E431 the gateway could not store the set, its log says why; active set 1 unchanged\n"
    assert gateway.log[-1].startswith("E431 calibration not stored: No space left on device")


def test_a_file_with_a_fault_is_told_before_anything_is_sent(call, tmp_path):
    path = tmp_path / "bad.yaml"
    path.write_text(as_text(calibration(4, rising_weights=(1.0, -1.0, 1.0))), encoding="utf-8")
    done = call("upload", path, "--gateway", "127.0.0.1:9")
    assert done.exit_code == 65
    assert "rising_weights[1]: rising weight 1 = -1: 0.001 .. 1000 is allowed" in done.stderr


def test_a_rig_that_takes_no_plain_upload_says_so(tmp_path, register_map, serve, call, file):
    gateway = Gateway(tmp_path / "closed", register_map)
    done = call("upload", file, "--gateway", serve(gateway.bank, role=Role.SETPOINT).address)
    assert done.exit_code == 1
    assert done.stderr.startswith("W211 ")
    gateway.upload.close()


def test_a_gateway_that_is_busy_says_so(gateway, address, call, file):
    gateway.bank.staging.show_commit(CommitStatus.WRITING)
    done = call("upload", file, "--gateway", address)
    assert done.exit_code == 1
    assert done.stderr.startswith("W219 ")


def test_a_commit_that_never_ends_is_waited_for_with_a_bound(gateway, address, call, file, monkeypatch):
    monkeypatch.setattr("gateway.cli.master.upload._PATIENCE_S", 0.05)
    gateway.upload.run_in_background = lambda work, done: None
    done = call("upload", file, "--gateway", address)
    assert done.exit_code == 1
    values, advice = done.stderr.split(": ")
    assert values == "E431 after 0.05 s the gateway is still checking"
    assert advice == "its disk probably hangs; look at its log and at the kernel's (dmesg)\n"


def test_another_set_than_the_one_sent_is_noticed(gateway, address, call, file):
    gateway.upload.on_use = lambda taken: gateway.bank.set_active_model(
        replace(taken.calibration, slip_shares=(0.5, 0.25, 0.25)), taken.pointer.active.slot_word
    )
    done = call("upload", file, "--gateway", address)
    assert done.exit_code == 1
    assert done.stderr.startswith("E434 committed, but another set is in use now (2 words differ, the first at 1680)")


def test_the_set_in_another_slot_than_the_one_asked_for_is_noticed(gateway, address, call, file):
    gateway.upload.on_use = lambda taken: gateway.bank.set_active_model(taken.calibration, 6)
    done = call("upload", file, "--slot", 5, "--gateway", address)
    assert done.exit_code == 1
    assert done.stderr.startswith("E434 committed, but another set is in use now (slot 6)")


# -- frames


def frames_of(call, *options: object) -> list[dict]:
    return json.loads(call("upload", *options, "--print-frames", "--dry-run", "--json").output)["frames"]


@pytest.mark.parametrize("fc06", [[], ["--fc06"]])
def test_printed_frames_played_by_anybody_make_the_upload(gateway, call, file, fc06):
    """What is printed is enough: the bytes go through the server's own framing into a bank that has seen no client."""
    gateway.upload.run_in_background = lambda work, done: done(work())
    frames = frames_of(call, file, "--slot", 6, *fc06)
    framer = MbapFramer()
    answers = []
    for frame in frames:
        (adu,) = framer.feed(bytes.fromhex(frame["frame"]))
        answers.append(answer(adu.pdu, gateway.bank, Peer("10.0.0.9", role=Role.CALIBRATION)))
    assert all(text[0] < 0x80 for text in answers)
    assert struct.unpack(">HHH", answers[-1][2:]) == (CommitStatus.COMMITTED, 0, 0)
    assert slot_number(gateway.store, 6) == 2
    assert gateway.store.load(2).slip_radii_v == (0.25, 0.5, 1.0)
    assert gateway.words(1500, 100) == CoefficientSet.of_calibration(calibration(16)).to_words()[:200]
    assert len(frames) == (194 if fc06 else 6)


def test_printing_with_a_dry_run_needs_no_gateway(call, file):
    done = call("upload", file, "--print-frames", "--dry-run", "--gateway", "127.0.0.1:9")
    assert done.exit_code == 0
    lines = done.output.splitlines()
    assert lines[0] == "frame 1 of 6  FC16 write 70 words at 1000 (41001): order, range, rising branch"
    assert lines[1].startswith("    00 01 00 00 00 93 01 10 03 E8 00 46 8C 00 02 00 00")
    assert "    1010  4250 0000  rising_b_2 = 52 N" in lines
    assert "    1012  0000 x 26  rising_b_3 .. rising_b_15 = 0" in lines
    assert "    1150  0003       slip_stops = 3" in lines
    assert "    1184  3E80 0000  slip_share_2 = 0.25" in lines
    assert "    1145  0001       commit = 1" in lines
    assert not [line for line in lines if len(line) > 120 and "commit_status" not in line]


@pytest.mark.parametrize("fc06", [[], ["--fc06"]])
def test_printed_for_a_serial_line_they_are_its_frames(call, file, fc06):
    """They were those of TCP, which no line carries."""
    by_tcp, serial = (frames_of(call, file, *fc06, *line) for line in ([], ["--rtu", "/dev/none", "--unit", 7]))
    for tcp, frame in zip(by_tcp, serial, strict=True):
        data = bytes.fromhex(frame["frame"])
        assert decode_adu(data) == (7, bytes.fromhex(tcp["frame"])[7:])
    printed = call("upload", file, *fc06, "--print-frames", "--dry-run", "--rtu", "/dev/none").output
    assert printed.splitlines()[1].startswith("    01 06 03 E8 00 02 " if fc06 else "    01 10 03 E8 00 46 8C 00 02 ")


def test_printing_alone_sends_as_well(gateway, address, call, file):
    done = call("upload", file, "--print-frames", "--gateway", address)
    assert done.output.startswith("frame 1 of 6")
    assert done.output.endswith("durable, and read back word by word\n")
    assert slot_number(gateway.store, 0) == 2


def test_no_request_is_longer_than_modbus_allows(call, file):
    assert all(
        len(bytes.fromhex(frame["frame"])) <= 260 and len(frame["words"]) <= 123 for frame in frames_of(call, file)
    )


@pytest.mark.parametrize(
    ("index", "words"),
    [
        (0, "index 0, rising handle 0"),
        (50, "index 50, falling weight 2"),
        (73, "index 73, slip radius 9"),
        (80, "index 80, slip share 0"),
        (97, "index 97, lag"),
        (99, "index 99, damping"),
        (-1, "the whole set"),
        (112, "the whole set"),
    ],
)
def test_an_index_is_told_as_a_place(index, words):
    assert place(index) == words


@pytest.mark.parametrize(
    ("lost", "dry", "told"), [("outcome", [], True), ("outcome", ["--dry-run"], False), ("_send", [], False)]
)
def test_a_gateway_that_is_lost_behind_the_commit_may_have_taken_it(
    gateway, address, call, monkeypatch, lost, dry, told
):
    """Who reads of a lost connection alone takes the old set for the one in use."""

    def lose(*arguments, **options):
        raise CliError("E131 it closed the connection", exit_codes.DEVICE)

    monkeypatch.setattr(UploadClient, lost, lose)
    done = call("upload", "demo", *dry, "--gateway", address)
    assert done.exit_code == exit_codes.DEVICE and done.stderr.startswith("E131 it closed the connection")
    assert ("the commit was sent, and the set may be in use: `force-gateway read calibration_id" in done.stderr) is told
