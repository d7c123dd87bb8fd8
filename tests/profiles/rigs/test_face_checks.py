"""What a rig file may say about its serial faces, and what keeps two users from one port."""

from pathlib import Path

import pytest

from gateway.modbus.pdu import read_write_request
from gateway.modbus.rtu import encode_adu
from gateway.profiles import Report, check_report, load_rig
from gateway.profiles.rigs.faces import RtuFace
from tests.certificates import store_all
from tests.profiles.rigs.test_checks import messages
from tests.profiles.rigs.test_tls_checks import files
from tests.profiles.rigs.test_tls_checks import report as tls_report

RIGS = Path(__file__).parents[3] / "profiles" / "rigs"
CELL = (RIGS / "irc5-cell.yaml").read_text(encoding="utf-8")
OUTPUT = "/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A10K1ITV-if00-port0"
GOOD = "{type: rtu, port: /dev/serial/by-id/rs485}"


def report(folder: Path, fieldbus: str, *, simulated: bool = False) -> Report:
    path = folder / "rig.yaml"
    path.write_text(f"{CELL}\nfieldbus: {fieldbus}\n", encoding="utf-8")
    return check_report(path, simulated=simulated)


def test_a_face_is_read_with_modbus_own_defaults(tmp_path: Path) -> None:
    rig = report(tmp_path, f"[{GOOD}]").rig
    assert rig is not None
    (face,) = rig.fieldbus
    assert (str(face.settings), face.unit) == ("19200 8E1", 1)
    assert load_rig("irc5-cell").fieldbus == ()


@pytest.mark.parametrize(
    ("fieldbus", "told"),
    [
        (f"[{{type: rtu, port: {OUTPUT}}}]", "fieldbus[0].port: is the output's port too: masters need an adapter"),
        (f"[{GOOD}, {GOOD}]", "fieldbus[1].port: is the port of fieldbus[0] too: a serial port carries one face"),
        ("[{type: rtu, port: /dev/ttyS9, unit: 0}]", "fieldbus[0].unit: 0 is the broadcast of Modbus RTU"),
        ("[{type: rtu, port: /dev/ttyS9, unit: 248}]", "fieldbus[0].unit: 248 is no unit id of Modbus RTU"),
        ("[{type: rtu, port: /dev/ttyS9, parity: evn}]", "fieldbus[0].parity: evn is not one of none, even, odd; did"),
        ("[{type: rtu, port: /dev/ttyS9, baud: 19201}]", "fieldbus[0].baud: 19201 is not one of 300, 600"),
        ("[{type: rtu, port: /dev/ttyS9, unti: 3}]", "fieldbus[0].unti: is not a known key; did you mean unit?"),
        (
            "[{type: tcp, port: 5021}]",
            "fieldbus[0]: type tcp is not one of rtu, tls; plain Modbus TCP has its keys under network: (bind",
        ),
        ("[{type: rtux, port: /dev/ttyS9}]", "fieldbus[0]: type rtux is not one of rtu, tls; did you mean rtu?"),
        ("[{type: null, port: /dev/ttyS9}]", "fieldbus[0]: has no type"),
        ("[{port: /dev/ttyS9}]", "fieldbus[0]: has no type: it says what this is, one of rtu, tls"),
        (
            "[{type: rtu, port: /dev/ttyS9, ca: a}]",
            "fieldbus[0].ca: is not a known key here; it belongs to a face of `type: tls`",
        ),
        (
            f"[{', '.join(f'{{type: rtu, port: /dev/ttyS{k}}}' for k in range(256))}]",
            "fieldbus[255]: is a serial face behind",
        ),
        ("[{type: rtu}]", "fieldbus[0].port: is missing: `force-gateway ports` lists"),
        ("[{type: rtu, port: ttyS9}]", 'fieldbus[0].port: "ttyS9" is not the path of a device'),
        ("[{type: rtu, port: EDIT}]", "fieldbus[0].port: EDIT is a placeholder"),
        ("{type: rtu}", "fieldbus: a group of keys is not a list"),
    ],
)
def test_a_face_that_cannot_work_is_told(tmp_path: Path, fieldbus: str, told: str) -> None:
    (fault,) = messages(report(tmp_path, fieldbus).faults)
    assert fault.startswith(told)


def test_two_names_of_one_port_are_one_port(tmp_path: Path) -> None:
    (tmp_path / "by-id").symlink_to("/dev/ttyS9")
    faces = f"[{{type: rtu, port: /dev/ttyS9}}, {{type: rtu, port: {tmp_path / 'by-id'}}}]"
    (fault,) = messages(report(tmp_path, faces).faults)
    assert fault.startswith("fieldbus[1].port: is the port of fieldbus[0] too")


def test_faces_of_a_rig_that_is_simulated_by_its_file_are_judged_with_sim_too(tmp_path: Path) -> None:
    """They are real ports, for --sim changes nothing of such a rig: two on one were told to stop "this very process" (E103)."""
    path = tmp_path / "rig.yaml"
    demo = (RIGS / "demo.yaml").read_text(encoding="utf-8")
    path.write_text(f"{demo}\nfieldbus: [{GOOD}, {GOOD}]\n", encoding="utf-8")
    (fault,) = messages(check_report(path, simulated=True).faults)
    assert fault.startswith("fieldbus[1].port: is the port of fieldbus[0] too")
    assert report(tmp_path, f"[{GOOD}, {GOOD}]", simulated=True).faults == ()  # a cell's own ports are left alone


def test_a_rig_needs_some_face(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(CELL.replace("  bind:", "  plain: false\n  bind:"), encoding="utf-8")
    (fault,) = messages(check_report(path).faults)
    assert fault.startswith("network.plain: false leaves no face that a master could reach")
    path.write_text(path.read_text(encoding="utf-8") + f"\nfieldbus: [{GOOD}]\n", encoding="utf-8")
    assert check_report(path).faults == ()


def test_a_port_that_may_change_its_name_is_a_warning(tmp_path: Path) -> None:
    warnings = messages(report(tmp_path, "[{type: rtu, port: /dev/ttyUSB0}]").warnings)
    assert any(told.startswith("fieldbus[0].port: /dev/ttyUSB0 may be another adapter") for told in warnings)


@pytest.mark.parametrize(
    ("face", "told"),
    [
        ("baud: 4800", "0.26 s on the wire at 4800 baud: a master that exchanges them loses its lease of 0.2 s (A310)"),
        ("baud: 9600", ""),
        ("baud: 4800, role: monitor", ""),  # reads only, and holds no lease
    ],
)
def test_a_face_that_is_slower_than_the_lease_is_a_warning(tmp_path: Path, face: str, told: str) -> None:
    """At 2400 baud `hold` lost its force within a second, and check had said nothing."""
    found = report(tmp_path, f"[{GOOD.removesuffix('}')}, {face}}}]")
    warnings = [one for one in messages(found.warnings) if one.startswith("fieldbus[0].baud")]
    assert warnings == ([f"fieldbus[0].baud: command and status take {told}"] if told else [])
    assert found.rig is not None
    (served,) = found.rig.fieldbus
    assert isinstance(served, RtuFace)
    asked = encode_adu(1, read_write_request(100, 32, 0, bytes(26)))
    bits = (len(asked) + len(encode_adu(1, bytes(2 + 64)))) * 11
    assert served.exchange_s(13 + 32) == pytest.approx(bits / served.baud + 2 * 3.5 * 11 / served.baud)


def test_a_simulated_run_takes_no_port_of_the_cell_and_says_so(tmp_path: Path) -> None:
    rig = report(tmp_path, f"[{{type: rtu, port: {OUTPUT}}}]", simulated=True).rig
    assert rig is not None and [face.port for face in rig.fieldbus] == [None]
    assert any(note.startswith("serial faces are pseudo-terminals") for note in rig.notes)


@pytest.mark.parametrize(
    ("mode", "told"),
    [
        (0o620, ["E172 {key} can be changed by its group (mode 620): chmod 600 {key}"]),
        (0o604, ["E172 {key} can be used by everybody on this machine (mode 604): chmod 600 {key}"]),
        (0o640, []),
    ],
)
def test_a_key_is_for_its_group_to_read_at_most(tmp_path: Path, mode: int, told: list[str]) -> None:
    store_all(tmp_path)
    key = tmp_path / "gateway.key"
    key.chmod(mode)
    faults = [str(fault) for fault in tls_report(tmp_path, files()).faults]
    assert len(faults) == len(told)
    assert all(sentence.format(key=key) in fault for sentence, fault in zip(told, faults, strict=True))
