"""The client verbs by TLS, against the real server; and what they say of files and gateways that do not fit."""

import asyncio
import os
import socket
import ssl
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import rsa

from gateway.cli.errors import CliError
from gateway.cli.master import wires
from gateway.cli.master.client import GatewayClient
from gateway.cli.master.tls_wire import TlsFiles, TlsWire
from gateway.fieldbus import ModbusTlsServer, ServerSettings, TlsSettings
from tests.certificates import Folder, serial_of, store_all
from tests.cli.conftest import PlainBank


class TlsServer(threading.Thread):
    def __init__(self, bank: PlainBank, folder: Folder) -> None:
        super().__init__(daemon=True)
        self.bank, self.folder = bank, folder
        self.bound, self.log = threading.Event(), list[str]()

    def run(self) -> None:
        asyncio.run(self._serve())

    async def _serve(self) -> None:
        self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
        crt, key = self.folder.crt, self.folder.key
        revoked = frozenset((serial_of("thief"),))
        files = TlsSettings(ServerSettings(), crt("gateway"), key("gateway"), crt("ca"), revoked)
        server = ModbusTlsServer(
            self.bank, files, on_peer_closed=lambda peer: None, log=lambda cause, sentence: self.log.append(sentence)
        )
        _, self.port = await server.start("127.0.0.1", 0)
        self.bound.set()
        await self._end.wait()
        await server.close()

    def stop(self) -> None:
        """A second call does nothing."""
        if not self.is_alive():
            return
        self._loop.call_soon_threadsafe(self._end.set)
        self.join(10)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    return store_all(tmp_path_factory.mktemp("certificates"))


@pytest.fixture
def server(register_map: Any, folder: Folder) -> Iterator[TlsServer]:
    running = TlsServer(PlainBank(register_map), folder)
    running.start()
    assert running.bound.wait(10)
    yield running
    running.stop()


def options(folder: Folder, name: str = "setpoint", key: str = "", ca: str = "ca") -> list[str]:
    return ["--tls", folder.crt(ca), "--cert", folder.crt(name), "--key", folder.key(key or name)]


def test_read_and_write_go_by_tls(server: TlsServer, folder: Folder, call: Any) -> None:
    where = ["--gateway", f"localhost:{server.port}"]
    assert call("write", "force_setpoint=12", *where, *options(folder)).exit_code == 0
    done = call("read", "force_setpoint", *where, *options(folder))
    assert done.exit_code == 0 and "12.00 N" in done.output
    assert server.log == []


@pytest.mark.parametrize(
    ("name", "key", "ca", "code", "words"),
    [
        ("thief", "", "ca", 69, "E176 127.0.0.1:{port} closed the connection: it probably refuses"),
        ("setpoint", "", "other-ca", 69, "E176 the certificate of 127.0.0.1:{port} is not to be trusted"),
        ("setpoint", "admin", "ca", 65, "E172 "),
    ],
)
def test_what_does_not_fit_is_told(
    server: TlsServer, folder: Folder, call: Any, name: str, key: str, ca: str, code: int, words: str
) -> None:
    done = call("read", "state", "--gateway", f"127.0.0.1:{server.port}", *options(folder, name, key, ca))
    assert (done.exit_code, done.stderr[: len(words.format(port=server.port))]) == (
        code,
        words.format(port=server.port),
    )


def test_a_key_of_another_kind_than_the_certificate_s_is_one_all_the_same(
    folder: Folder, call: Any, tmp_path: Path
) -> None:
    """An RSA key beside a certificate of P-256 was 'no PEM file with a private key'."""
    form = (serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    other = tmp_path / "rsa.key"
    other.write_bytes(rsa.generate_private_key(public_exponent=65537, key_size=2048).private_bytes(*form))
    given = ["--tls", folder.crt("ca"), "--cert", folder.crt("setpoint"), "--key", other]
    done = call("read", "state", *given)
    assert (done.exit_code, done.stderr.startswith(f"E172 {other} does not fit {folder.crt('setpoint')}: ")) == (
        65,
        True,
    )


def test_a_gateway_that_ends_behind_its_answers_has_not_refused_the_certificate(
    server: TlsServer, folder: Folder, register_map: Any
) -> None:
    """A self-test whose gateway was killed was told that its certificate was probably refused."""
    files = TlsFiles(*(Path(one) for one in (folder.crt("ca"), folder.crt("setpoint"), folder.key("setpoint"))))
    with GatewayClient(TlsWire("127.0.0.1", server.port, files), 1, register_map) as client:
        client.check_map()
        server.stop()
        with pytest.raises(
            CliError, match=r"^E131 127\.0\.0\.1:\d+ closed the connection, though it answered before: "
        ):
            client.check_map()


def test_a_handshake_without_an_answer_is_no_connection_that_ended(
    folder: Folder, call: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a gateway that stands still, or a network that is cut: it was said that the connection ended."""
    monkeypatch.setattr(wires, "TIMEOUT_S", 0.05)
    with socket.create_server(("127.0.0.1", 0)) as deaf:
        where = f"127.0.0.1:{deaf.getsockname()[1]}"
        done = call("read", "state", "--gateway", where, *options(folder))
    assert done.exit_code == 69 and done.stderr.startswith(f"E176 no TLS with {where}: no answer within 1 s; ")


def test_a_file_that_is_missing_and_options_that_are(folder: Folder, call: Any, tmp_path: Path) -> None:
    gone = ["--tls", folder.crt("ca"), "--cert", tmp_path / "gone.crt", "--key", folder.key("setpoint")]
    done = call("read", "state", *gone)
    assert (done.exit_code, done.stderr) == (65, f"E171 {tmp_path / 'gone.crt'}: No such file or directory\n")
    assert "--key is missing: TLS needs" in call("read", "state", *options(folder)[:4]).stderr
    assert "--rtu is of a serial line" in call("read", "state", "--rtu", "/dev/ttyS9", *options(folder)).stderr


def test_a_key_with_a_password_and_a_weak_one_are_pem_files(folder: Folder, call: Any, tmp_path: Path) -> None:
    """They were called none."""
    key = serialization.load_pem_private_key(Path(folder.key("setpoint")).read_bytes(), None)
    locked, form = serialization.BestAvailableEncryption(b"secret"), serialization.PrivateFormat
    for name, kind in (("new", form.PKCS8), ("old", form.TraditionalOpenSSL)):
        path = tmp_path / f"{name}.key"
        path.write_bytes(key.private_bytes(serialization.Encoding.PEM, kind, locked))
        done = call("read", "state", "--tls", folder.crt("ca"), "--cert", folder.crt("setpoint"), "--key", path)
        assert (done.exit_code, done.stderr) == (
            65,
            f"E174 {path} has a password, and nobody is asked for it: openssl pkey -in {path} -out NEW.key takes it off\n",
        )
    weak = TlsFiles(Path(folder.crt("ca")), Path(folder.crt("setpoint")), Path(folder.key("setpoint")))
    told = TlsWire("127.0.0.1", 802, weak)._unfit("EE_KEY_TOO_SMALL")
    assert told.startswith(f"E174 {weak.certificate} is refused by this machine's OpenSSL (ee key too small): ")


@pytest.mark.parametrize(("broken", "told"), [(0, "a certificate"), (1, "a certificate"), (2, "a private key")])
def test_of_three_files_the_one_that_is_none_is_named(
    folder: Folder, call: Any, tmp_path: Path, broken: int, told: str
) -> None:
    """'A, B or C is no PEM file of its kind' left it to be found."""
    (tmp_path / "x.pem").write_text("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")
    files = [folder.crt("ca"), folder.crt("setpoint"), folder.key("setpoint")]
    files[broken] = str(tmp_path / "x.pem")
    done = call("read", "state", "--tls", files[0], "--cert", files[1], "--key", files[2])
    assert (done.exit_code, done.stderr) == (65, f"E174 {tmp_path / 'x.pem'} is no PEM file with {told}\n")


def test_certs_makes_what_a_rig_and_a_client_need_and_overwrites_nothing(tmp_path: Path, call: Any) -> None:
    made = call("certs", tmp_path / "c", "--host", "192.168.125.20", "--client", "robot:setpoint")
    assert made.exit_code == 0 and "fieldbus:" in made.output
    assert {path.name for path in (tmp_path / "c").glob("*.key")} == {"ca.key", "gateway.key", "robot.key"}
    assert {path.stat().st_mode & 0o777 for path in (tmp_path / "c").glob("*.key")} == {0o600}
    before = (tmp_path / "c" / "ca.crt").read_bytes()
    again = call("certs", tmp_path / "c", "--client", "robot:admin")
    assert again.exit_code == 1 and again.stderr.startswith(f"E405 {tmp_path / 'c' / 'robot.crt'} exists")
    assert call("certs", tmp_path / "c", "--client", "panel:monitor").exit_code == 0
    assert (tmp_path / "c" / "ca.crt").read_bytes() == before
    assert (tmp_path / "c" / "panel.crt").exists()
    for bad in ("robot", "robot:captain", "ca:admin", "a/b:monitor"):
        assert call("certs", tmp_path / "d", "--client", bad).exit_code == 2
    twice = call("certs", tmp_path / "d", "--client", "robot:setpoint", "--client", "robot:admin")
    assert twice.exit_code == 2 and "robot is there twice" in " ".join(twice.stderr.split())
    nobody = call("certs", tmp_path / "c")
    assert nobody.exit_code == 2 and "whom it shall sign for" in " ".join(nobody.stderr.split())
    for bad in ("not a host!", "cell3:8802", "192.168.1", "192.168.125.320", "-x", "a..b"):
        answer = call("certs", tmp_path / "d", "--host", bad)
        assert answer.exit_code == 2 and "neither a host name" in " ".join(answer.stderr.split())
    assert call("certs", tmp_path / "e", "--host", "cell-3.local", "--host", "fe80::1").exit_code == 0


def test_a_gateway_is_believed_by_its_name_alone(server: TlsServer, folder: Folder, call: Any) -> None:
    """Any server's certificate of the same CA would else do: a neighbour cell's could be put in between."""
    files = TlsFiles(Path(folder.crt("ca")), Path(folder.crt("setpoint")), Path(folder.key("setpoint")))
    wire = TlsWire("127.0.0.1", server.port, files)
    context = wire._context()
    assert context.check_hostname and context.verify_mode is ssl.CERT_REQUIRED
    assert context.minimum_version is ssl.TLSVersion.TLSv1_2
    elsewhere = TlsWire("cell-3.local", server.port, files)
    with (
        socket.create_connection(("127.0.0.1", server.port)) as plain,
        pytest.raises(CliError, match=r"E176 the certificate of cell-3\.local:\d+ is not to be trusted"),
    ):
        elsewhere._shake_hands(context, plain)
    assert not wire.is_served_by({"port": server.port}), "what a gateway tells of itself is its plain port"


@pytest.mark.parametrize(
    ("number", "cure"), [(9, "the clocks of both machines"), (10, "make new ones there"), (19, "give --tls the CA")]
)
def test_what_is_out_of_its_days_wants_a_clock_or_another_one_and_no_other_ca(number: int, cure: str) -> None:
    class Context:
        def wrap_socket(self, *words: Any, **more: Any) -> None:
            error = ssl.SSLCertVerificationError(1, "certificate verify failed")
            error.verify_code, error.verify_message = number, "no good"
            raise error

    wire = TlsWire("127.0.0.1", 802, TlsFiles(Path("ca"), Path("crt"), Path("key")))
    with pytest.raises(CliError, match=f"E176 .* is not to be trusted: no good; .*{cure}"):
        wire._shake_hands(Context(), None)  # type: ignore[arg-type]


def test_a_folder_of_keys_is_for_its_owner_alone(tmp_path: Path, call: Any) -> None:
    previous = os.umask(0)
    try:
        assert call("certs", tmp_path / "c", "--client", "robot:setpoint").exit_code == 0
    finally:
        os.umask(previous)
    assert (tmp_path / "c").stat().st_mode & 0o777 == 0o700
