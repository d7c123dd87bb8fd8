"""What `certs` writes: keys for their owner's eyes, nothing over what is there, and nobody's certificate signs another one."""

import shlex
import stat
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
import yaml
from click.testing import CliRunner
from cryptography import x509
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import ExtendedKeyUsageOID

from gateway.cli.main import command
from gateway.cli.setup.certificates import Signed, load_ca, make_ca, make_client, make_server, store
from gateway.modbus import Role
from gateway.processes import exit_codes


@pytest.fixture(scope="module")
def ca() -> Signed:
    return make_ca(30)


@pytest.mark.usefixtures("generous_umask")
def test_a_key_is_for_its_owners_eyes_alone(ca: Signed, tmp_path: Path) -> None:
    store({"ca": ca}, tmp_path)
    assert stat.S_IMODE((tmp_path / "ca.key").stat().st_mode) == 0o600


@pytest.mark.parametrize("there", ["ca.key", "ca.crt"])
def test_nothing_is_written_over_what_is_there(ca: Signed, tmp_path: Path, there: str) -> None:
    """A CA whose key is gone has certified all its clients for nothing."""
    (tmp_path / there).write_text("precious")
    with pytest.raises(FileExistsError):
        store({"ca": ca}, tmp_path)
    assert (tmp_path / there).read_text() == "precious"


def test_where_one_cannot_be_written_none_is_left(ca: Signed, tmp_path: Path) -> None:
    """On a full disk an empty ca.crt stayed beside its key: the same command refused it from then on."""
    (tmp_path / "robot.crt").mkdir()
    with pytest.raises(OSError, match="exists"):
        store({"ca": ca, "robot": make_client(ca, "robot", Role.SETPOINT, 30)}, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["robot.crt"]


def test_only_the_ca_signs_certificates(ca: Signed) -> None:
    """Else who has one for a robot makes himself an admin."""
    made = [ca, make_server(ca, ["127.0.0.1"], 30), make_client(ca, "robot", Role.SETPOINT, 30)]
    signs = [
        (
            each.certificate.extensions.get_extension_for_class(x509.BasicConstraints).value.ca,
            each.certificate.extensions.get_extension_for_class(x509.KeyUsage).value.key_cert_sign,
        )
        for each in made
    ]
    assert signs == [(True, True), (False, False), (False, False)]
    assert ca.certificate.extensions.get_extension_for_class(x509.BasicConstraints).value.path_length == 0


def test_a_client_s_certificate_is_no_server_s_and_the_other_way_round(ca: Signed) -> None:
    """Else who has one for a panel can pose as the gateway."""
    made = [make_server(ca, ["127.0.0.1"], 30), make_client(ca, "robot", Role.SETPOINT, 30)]
    uses = [list(each.certificate.extensions.get_extension_for_class(x509.ExtendedKeyUsage).value) for each in made]
    assert uses == [[ExtendedKeyUsageOID.SERVER_AUTH], [ExtendedKeyUsageOID.CLIENT_AUTH]]


def test_a_clock_that_is_half_an_hour_behind_takes_a_new_certificate(ca: Signed) -> None:
    """A robot controller's clock is set by hand."""
    half_an_hour_ago = datetime.now(UTC) - timedelta(minutes=30)
    made = [ca, make_server(ca, ["127.0.0.1"], 30), make_client(ca, "robot", Role.SETPOINT, 30)]
    assert all(each.certificate.not_valid_before_utc < half_an_hour_ago for each in made)


def test_a_ca_with_another_s_key_signs_nothing(ca: Signed, tmp_path: Path) -> None:
    store({"ca": ca}, tmp_path)
    assert load_ca(tmp_path).certificate == ca.certificate
    store({"other": make_ca(30)}, tmp_path)
    (tmp_path / "other.key").replace(tmp_path / "ca.key")
    with pytest.raises(ValueError, match=r"ca\.key does not fit ca\.crt"):
        load_ca(tmp_path)


def test_nothing_outlives_the_ca_that_has_signed_it(tmp_path: Path) -> None:
    """It would be refused from the CA's last day on, whatever its own days."""
    short = make_ca(5)
    made = [make_server(short, ["127.0.0.1"], 30), make_client(short, "robot", Role.SETPOINT, 30)]
    assert {each.certificate.not_valid_after_utc for each in made} == {short.certificate.not_valid_after_utc}
    store({"ca": short}, tmp_path)
    said = CliRunner().invoke(command, ["certs", str(tmp_path), "--client", "robot:setpoint"])
    assert said.exit_code == 0
    ends = f"{short.certificate.not_valid_after_utc:%Y-%m-%d}"
    assert said.output.startswith(f"{tmp_path}/ca.crt ends on {ends}, and all that it signs no later: make a new CA")


def with_password(folder: Path) -> None:
    key = serialization.load_pem_private_key((folder / "ca.key").read_bytes(), None)
    form = (serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.BestAvailableEncryption(b"x"))
    (folder / "ca.key").write_bytes(key.private_bytes(*form))


def of_another_kind(folder: Path) -> None:
    key = rsa.generate_private_key(65537, 2048)
    form = (serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    (folder / "ca.key").write_bytes(key.private_bytes(*form))


def without_key(folder: Path) -> None:
    (folder / "ca.key").unlink()


@pytest.mark.parametrize(
    ("days", "spoil", "sentence"),
    [
        (-1, None, "it expired on 20"),
        (30, with_password, "ca.key has a password: openssl pkey -in ca.key -out NEW.key takes it off"),
        (30, without_key, "{folder}/ca.key: No such file or directory; another DIR makes a new one"),
        (30, of_another_kind, "ca.key is none over an elliptic curve, as certs makes them"),
    ],
)
def test_a_ca_that_cannot_sign_is_told_apart(
    tmp_path: Path, days: int, spoil: Callable[[Path], None] | None, sentence: str
) -> None:
    """An expired one signed for nothing and said that it had worked; a key with a password was an internal error."""
    store({"ca": make_ca(days)}, tmp_path)
    if spoil:
        spoil(tmp_path)
    said = CliRunner().invoke(command, ["certs", str(tmp_path), "--client", "robot:setpoint"])
    assert said.exit_code == exit_codes.DATA and not (tmp_path / "robot.crt").exists()
    assert said.output.startswith(f"E174 the CA in {tmp_path} cannot be used: {sentence.format(folder=tmp_path)}")


def test_it_is_said_when_a_client_is_shut_out(tmp_path: Path) -> None:
    """A serial number written into the rig file shut nobody out until somebody came to start the gateway anew."""
    said = CliRunner().invoke(command, ["certs", str(tmp_path / "keys")]).output
    shut_out = said[said.index("To shut a client out") :]
    assert "`revoked:`" in shut_out and "start the gateway anew" in shut_out and "stays connected" in shut_out


def test_what_to_do_next_can_be_pasted(tmp_path: Path) -> None:
    folder = tmp_path / "my keys"
    said = CliRunner().invoke(command, ["certs", str(folder), "--host", "fd00::5", "--client", "robot:setpoint"])
    (line,) = (line for line in said.output.splitlines() if line.startswith("  force-gateway read "))
    words = shlex.split(line)
    client = f"{folder}/robot"
    theirs = ["--tls", f"{folder}/ca.crt", "--cert", f"{client}.crt", "--key", f"{client}.key"]
    assert words[3:] == ["--gateway", "[fd00::5]:8802", *theirs]
    assert "bind: fd00::5, port: 8802" in said.output


@pytest.mark.parametrize("host", ["::1", "fd00::5", "192.168.125.20", "cell3.local"])
def test_the_lines_for_the_rig_file_are_yaml_whatever_the_folder_is_called(host: str, tmp_path: Path) -> None:
    folder = tmp_path / "keys, left: 1"
    result = CliRunner().invoke(command, ["certs", str(folder), "--host", host])
    assert result.exit_code == exit_codes.OK, result.output
    text = result.output.partition("fieldbus:")[2].partition("Then try")[0]
    (face,) = yaml.safe_load(f"fieldbus:{text}")["fieldbus"]
    assert face["bind"] == ("127.0.0.1" if host == "cell3.local" else host)
    assert [Path(face[key]).is_file() for key in ("certificate", "key", "ca")] == [True] * 3


def test_an_empty_name_is_no_folder_for_a_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    refused = CliRunner().invoke(command, ["certs", ""])
    assert refused.exit_code == 2 and "an empty name: is a variable" in refused.stderr
    assert not list(tmp_path.iterdir())
