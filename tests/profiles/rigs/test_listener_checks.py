"""Two faces of a rig on one port: check said 'no faults', and the start was refused."""

from pathlib import Path

import pytest

from gateway.profiles import Report, check_report
from tests.profiles.rigs.test_checks import messages

DEMO = (Path(__file__).parents[3] / "profiles" / "rigs" / "demo.yaml").read_text(encoding="utf-8")
TLS = "{type: tls, bind: 127.0.0.1, port: 8802, certificate: a, key: b, ca: c}"


def report(folder: Path, sections: str) -> Report:
    path = folder / "rig.yaml"
    path.write_text(f"{DEMO}\n{sections}\n", encoding="utf-8")
    return check_report(path)


@pytest.mark.parametrize(
    ("sections", "told"),
    [
        ('web: {listen: "127.0.0.1:5020"}', "web.listen: port 5020 is that of network.port, too: give it another one"),
        (
            'web: {listen: "127.0.0.1:8080"}\nmetrics: {listen: "0.0.0.0:8080"}',
            "metrics.listen: port 8080 is that of web.listen, too: give it another one",
        ),
        (
            f'fieldbus: [{TLS}]\nweb: {{listen: "127.0.0.1:8802"}}',
            "web.listen: port 8802 is that of fieldbus[0].port, too: give it another one",
        ),
    ],
)
def test_a_port_that_another_face_has_is_a_fault_at_the_second_one(tmp_path: Path, sections: str, told: str) -> None:
    assert told in messages(report(tmp_path, sections).faults)


@pytest.mark.parametrize(
    "sections",
    [
        'web: {listen: "127.0.0.1:0"}\nmetrics: {listen: "127.0.0.1:0"}',
        'web: {listen: "127.0.0.2:5020"}',
        'web: {listen: "[::1]:5020"}',
        "web: {}\nmetrics: {}\nopcua: {}",
    ],
)
def test_any_free_port_and_another_address_meet_nobody(tmp_path: Path, sections: str) -> None:
    checked = report(tmp_path, sections)
    assert not checked.faults and not checked.warnings


def test_an_opc_ua_server_on_a_port_of_another_face_keeps_no_rig_from_starting(tmp_path: Path) -> None:
    checked = report(tmp_path, 'opcua: {listen: "127.0.0.1:5020"}')
    assert not checked.faults and checked.rig is not None
    (warned,) = messages(checked.warnings)
    assert warned == "opcua.listen: port 5020 is that of network.port, too: give it another one"
