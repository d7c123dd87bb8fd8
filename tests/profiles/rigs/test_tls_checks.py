"""What a rig file may say about a TLS face: each of its files that cannot be used is told with its line, before the start."""

import ssl
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import NameOID

from gateway.cli.setup.certificates import Signed, make_ca, make_server, store
from gateway.fieldbus.peers import address_of
from gateway.modbus import Peer
from gateway.modbus.certificate import read_certificate
from gateway.profiles import Report, check_report
from gateway.profiles.rigs.checks import tls as tls_checks
from gateway.profiles.rigs.faces import TlsFace
from tests.certificates import serial_of, store_all
from tests.other_kinds import never_waiting, put

DEMO = (Path(__file__).parents[3] / "profiles" / "rigs" / "demo.yaml").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("certificates")
    store_all(folder)
    (folder / "no.crt").write_text("nothing of the kind")
    (folder / "no.key").write_text("nothing of the kind")
    (folder / "cut.crt").write_text("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")
    (folder / "open.key").write_bytes((folder / "gateway.key").read_bytes())
    (folder / "open.key").chmod(0o644)
    key = serialization.load_pem_private_key((folder / "gateway.key").read_bytes(), None)
    locked = serialization.BestAvailableEncryption(b"secret")
    form = (serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8)
    (folder / "locked.key").write_bytes(key.private_bytes(*form, locked))
    of_rsa = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    (folder / "rsa.key").write_bytes(of_rsa.private_bytes(*form, serialization.NoEncryption()))
    for name in ("no.key", "cut.crt", "locked.key", "rsa.key"):
        (folder / name).chmod(0o600)
    return folder


def report(folder: Path, *faces: str) -> Report:
    path = folder / "rig.yaml"
    path.write_text(
        f"{DEMO}\nfieldbus:\n" + "".join(f"  - {{type: tls, {face}}}\n" for face in faces), encoding="utf-8"
    )
    return check_report(path, simulated=True)


def files(certificate: str = "gateway.crt", key: str = "gateway.key", ca: str = "ca.crt", more: str = "") -> str:
    return f"certificate: {certificate}, key: {key}, ca: {ca}{more}"


def test_a_face_is_read_its_paths_from_the_file_and_its_port_from_the_standard(folder: Path) -> None:
    rig = report(folder, files(more=', revoked: ["0a:1b:2c"]')).rig
    assert rig is not None
    (face,) = rig.fieldbus
    assert isinstance(face, TlsFace)
    assert (face.port, face.bind, face.certificate) == (802, "127.0.0.1", str(folder / "gateway.crt"))
    assert face.revoked == ("0A1B2C",)


@pytest.mark.parametrize("written", ["{}", "00:{}", "0000{}"])
def test_a_revoked_certificate_is_meant_however_many_zeros_stand_before_its_number(folder: Path, written: str) -> None:
    """As a browser shows it, with the zero octet of its sign, it was nobody's: the certificate still connected."""
    number = serial_of("thief")
    rig = report(folder, files(more=f', revoked: ["{written.format(number)}"]')).rig
    assert rig is not None and isinstance(rig.fieldbus[0], TlsFace)
    shown = read_certificate(ssl.PEM_cert_to_DER_cert((folder / "thief.crt").read_text()))
    assert shown.serial in rig.fieldbus[0].revoked


FAULTS = [
    (
        files("gone.crt"),
        "fieldbus[0].certificate",
        "E171 {folder}/gone.crt: No such file or directory; `force-gateway certs",
    ),
    (files(ca="gone.crt"), "fieldbus[0].ca", "E171 {folder}/gone.crt: No such file"),
    (
        files(key="open.key"),
        "fieldbus[0].key",
        "E172 {folder}/open.key can be used by everybody on this machine (mode 644)",
    ),
    (
        files(key="admin.key"),
        "fieldbus[0].key",
        "E172 {folder}/admin.key does not fit {folder}/gateway.crt: take the two",
    ),
    (
        files(key="rsa.key"),  # of another kind than the certificate's: "no certificate assigned" was all that was said
        "fieldbus[0].key",
        "E172 {folder}/rsa.key does not fit {folder}/gateway.crt: take the two",
    ),
    (files("no.crt"), "fieldbus[0].certificate", "E174 {folder}/no.crt holds no certificate in PEM form"),
    (files(key="no.key"), "fieldbus[0].key", "E174 {folder}/no.key holds no private key in PEM form"),
    (
        files(key="locked.key"),
        "fieldbus[0].key",
        "E174 {folder}/locked.key has a password, and nobody is there to type",
    ),
    (files(ca="gateway.key"), "fieldbus[0].ca", "E174 {folder}/gateway.key holds no certificate in PEM form"),
    (files(ca="cut.crt"), "fieldbus[0].ca", "E174 {folder}/cut.crt cannot be used: "),
    (files("cut.crt"), "fieldbus[0].certificate", "E174 {folder}/cut.crt with {folder}/gateway.key cannot be used: "),
    (
        files(ca="other-ca.crt"),
        "fieldbus[0].certificate",
        "E175 {folder}/gateway.crt is not signed by the CA of this face: no client that trusts {folder}/other-ca.crt",
    ),
    (
        files("setpoint.crt", "setpoint.key"),
        "fieldbus[0].certificate",
        "E175 {folder}/setpoint.crt is not one for a server (a client's?): no client",
    ),
    (
        files("."),
        "fieldbus[0].certificate",
        "E171 {folder}: it is a directory, and no file: move it away, or name another",
    ),
    (files(more=", port: 5020"), "fieldbus[0].port", "5020 is the port of plain Modbus TCP too"),
    (
        files(more=", bind: 192.168.125.20"),
        "fieldbus[0].bind",
        "192.168.125.20 can be reached from other machines: say",
    ),
    (files(more=", revoked: [robot]"), "fieldbus[0].revoked[0]", '"robot" is no serial number in hex'),
    ("key: gateway.key, ca: ca.crt", "fieldbus[0].certificate", "is missing"),
]


@pytest.mark.parametrize(("face", "place", "sentence"), FAULTS)
def test_what_cannot_work_is_told_with_its_place(folder: Path, face: str, place: str, sentence: str) -> None:
    (fault,) = report(folder, face).faults
    assert f"rig.yaml:{DEMO.count(chr(10)) + 3}:" in str(fault)
    assert str(fault).split(" ", 1)[1].startswith(f"{place}: {sentence.format(folder=folder)}")


@pytest.mark.parametrize("kind", ["a pipe", "a socket", "a device"])
@pytest.mark.parametrize("name", ["certificate", "key", "ca"])
def test_no_check_waits_for_what_is_no_file(name: str, kind: str, folder: Path, tmp_path: Path) -> None:
    face = {"certificate": folder / "gateway.crt", "key": folder / "gateway.key", "ca": folder / "ca.crt"}
    face[name] = put(kind, tmp_path / "other")
    with never_waiting():
        (fault,) = report(folder, ", ".join(f"{key}: {file}" for key, file in face.items())).faults
    assert f"fieldbus[0].{name}: E171 {tmp_path}/other: it is {kind}, and no file" in str(fault)


@pytest.mark.parametrize(
    ("owner", "more", "sentence"),
    [
        (
            "certificate robot",
            "",
            "certificate robot: no face of this rig asks for certificates, so nobody could command",
        ),
        (
            "10.0.0.1",
            "\nfieldbus:\n  - {type: rtu, port: /dev/ttyS7}\n",
            "10.0.0.1 commands by plain Modbus TCP only, which this rig does not serve",
        ),
    ],
)
def test_an_owner_that_no_face_lets_in_is_told(tmp_path: Path, owner: str, more: str, sentence: str) -> None:
    plain = "  plain: false\n" if more else ""
    text = DEMO.replace("network:\n", f"network:\n{plain}  owner: {owner}\n", 1) + more
    (tmp_path / "rig.yaml").write_text(text, encoding="utf-8")
    (fault,) = check_report(tmp_path / "rig.yaml", simulated=True).faults
    assert f"network.owner: {sentence}" in str(fault)


@pytest.mark.parametrize("host", ["fe80::1%eth0", "::ffff:10.0.0.5", "FD00:0::5", "10.0.0.5"])
def test_an_owner_is_whoever_connects_from_that_address_however_it_is_written(tmp_path: Path, host: str) -> None:
    """With a scope, or as the IPv6 form of an IPv4 address, it was nobody, and no master could command."""
    (tmp_path / "rig.yaml").write_text(
        DEMO.replace("network:\n", f'network:\n  owner: "{host}"\n', 1), encoding="utf-8"
    )
    rig = check_report(tmp_path / "rig.yaml", simulated=True).rig
    assert rig is not None and rig.network.owner == Peer(str(address_of(host))).identity


def test_two_faces_on_one_port_are_told(folder: Path) -> None:
    (fault,) = report(folder, files(), files()).faults
    assert "fieldbus[1].port: 802 is the port of another TLS face too" in str(fault)


def test_the_address_of_all_addresses_meets_each_of_its_family(folder: Path) -> None:
    everywhere = ", bind: 0.0.0.0, allow: [0.0.0.0/0]"
    (fault,) = report(folder, files(), files(more=everywhere)).faults
    assert "fieldbus[1].port: 802 is the port of another TLS face too" in str(fault)
    told = report(folder, files(more=f"{everywhere}, port: 5020"))
    assert "fieldbus[0].port: 5020 is the port of plain Modbus TCP too" in str(told.faults[0])
    assert any("fieldbus[0].allow: lets every address" in str(warning) for warning in told.warnings)
    assert not report(folder, files(), files(more=', bind: "::", allow: ["fd00::/8"]')).faults


def test_a_certificate_that_is_about_to_expire_is_a_warning_and_told_at_the_start(folder: Path) -> None:
    found = report(folder, files())  # the tests' own last ten days
    assert found.rig is not None and found.rig.notes[0].startswith("W246 ")
    assert any("W246 " in str(each) and "expires on 20" in str(each) for each in found.warnings)


def test_a_clock_that_nobody_has_set_yet_is_told_and_ends_no_start(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A machine without a clock of its own has the time seconds after its boot. By then the service had ended with 78, and
    systemd does not start again what ends so."""
    monkeypatch.setattr(tls_checks, "_utc", lambda days=0: "19700101000012Z")
    found = report(folder, files())
    told = [str(each).split(" ", 1)[1] for each in found.warnings if "E173" in str(each)]
    assert found.rig is not None and not found.faults
    assert [each.split(" is not valid before 20")[0] for each in told] == [
        f"fieldbus[0].certificate: E173 {folder}/gateway.crt",
        f"fieldbus[0].ca: E173 {folder}/ca.crt",
    ]
    assert [note for note in found.rig.notes if "this machine's clock" in note]


def test_a_certificate_that_has_expired_is_told_and_ends_no_start(folder: Path) -> None:
    """Behind a power cut a weekend later the service had ended with 78 for good, and with it the page and all other faces."""
    found = report(folder, files("expired-gateway.crt", "expired-gateway.key"))
    (told,) = (str(each) for each in found.warnings if "E173" in str(each))
    assert f"fieldbus[0].certificate: E173 {folder}/expired-gateway.crt expired on 20" in told
    assert found.rig and [note for note in found.rig.notes if "until there is a new one no client connects" in note]


def test_an_owner_may_be_named_by_its_certificate(folder: Path) -> None:
    path = folder / "owned.yaml"
    text = DEMO.replace("network:\n", "network:\n  owner: certificate robot\n", 1)
    path.write_text(f"{text}\nfieldbus:\n  - {{type: tls, {files()}}}\n", encoding="utf-8")
    rig = check_report(path, simulated=True).rig
    assert rig is not None and rig.network.owner == "certificate robot"


def signed_by(root: Signed, ca: Signed) -> Signed:
    """The same CA, signed by another one."""
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "cell CA")])
    old, now = ca.certificate, datetime.now(UTC)
    builder = x509.CertificateBuilder(root.certificate.subject, name, ca.key.public_key(), x509.random_serial_number())
    builder = builder.not_valid_before(now - timedelta(days=3)).not_valid_after(old.not_valid_after_utc)
    builder = builder.add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
    return Signed(builder.sign(root.key, hashes.SHA256()), ca.key)


def ending(ca: Signed, days: int, begins: int = -3, **constraints: int | None) -> Signed:
    """The same CA with other days."""
    old, now = ca.certificate, datetime.now(UTC)
    builder = x509.CertificateBuilder(old.issuer, old.subject, ca.key.public_key(), old.serial_number)
    for extension in old.extensions:
        is_other = constraints and isinstance(extension.value, x509.BasicConstraints)
        value = x509.BasicConstraints(ca=True, **constraints) if is_other else extension.value
        builder = builder.add_extension(value, extension.critical)
    builder = builder.not_valid_before(now + timedelta(days=begins)).not_valid_after(now + timedelta(days=days))
    return Signed(builder.sign(ca.key, hashes.SHA256()), ca.key)


@pytest.mark.parametrize("days", [-1, 5, 40])
def test_the_ca_s_end_is_told_as_its_own(tmp_path: Path, days: int) -> None:
    """By its own days the gateway's certificate was good; it was called one of another CA, and a new one helped nobody."""
    ca = make_ca(40)
    store({"gateway": make_server(ca, ("127.0.0.1",), 20), "ca": ending(ca, days)}, tmp_path)
    found = report(tmp_path, files())
    assert not found.faults
    told = [str(each).split(" ", 1)[1] for each in found.warnings if "fieldbus" in str(each)]
    own = f"fieldbus[0].certificate: W246 {tmp_path}/gateway.crt expires on 20"
    its_ca = f"fieldbus[0].ca: W246 {tmp_path}/ca.crt expires on 20"
    too_late = f"fieldbus[0].certificate: E175 {tmp_path}/gateway.crt is of a CA that has expired, as all"
    expected = {-1: [too_late, own], 5: [own, its_ca], 40: [own]}[days]
    assert [each[: len(start)] for each, start in zip(told, expected, strict=True)] == expected


def test_the_days_of_the_first_certificate_and_of_any_ca_must_have_begun(tmp_path: Path) -> None:
    ca = make_ca(90)
    later, server = ending(ca, 90, begins=2), make_server(ca, ("127.0.0.1",), 60)

    def told(more_in: str, **signed: Signed) -> list[str]:
        folder = tmp_path / more_in
        folder.mkdir()
        store(signed, folder)
        with (folder / more_in).open("ab") as file:
            file.write(ca.certificate.public_bytes(serialization.Encoding.PEM))
        found = report(folder, files())
        assert not found.faults
        warnings = [str(each) for each in found.warnings if "not valid before" in str(each)]
        return [each.split("fieldbus[0].")[1].split(":")[0] for each in warnings]

    assert told("none", gateway=server, ca=later) == ["ca"]
    assert told("ca.crt", gateway=server, ca=later) == []
    assert told("gateway.crt", gateway=ending(server, 60, begins=2), ca=ca) == ["certificate"]
