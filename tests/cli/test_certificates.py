"""What `certs` writes: keys for their owner's eyes, nothing over what is there, and nobody's certificate signs another one."""

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.x509.oid import ExtendedKeyUsageOID

from gateway.cli.certificates import Signed, load_ca, make_ca, make_client, make_server, store
from gateway.modbus import Role


@pytest.fixture(scope="module")
def ca() -> Signed:
    return make_ca(30)


@pytest.fixture
def generous_umask() -> Iterator[None]:
    """Takes nothing away: what is seen is what was asked for."""
    previous = os.umask(0)
    yield
    os.umask(previous)


@pytest.mark.usefixtures("generous_umask")
def test_a_key_is_for_its_owners_eyes_alone(ca: Signed, tmp_path: Path) -> None:
    store(ca, tmp_path, "ca")
    assert stat.S_IMODE((tmp_path / "ca.key").stat().st_mode) == 0o600


@pytest.mark.parametrize("there", ["ca.key", "ca.crt"])
def test_nothing_is_written_over_what_is_there(ca: Signed, tmp_path: Path, there: str) -> None:
    """A CA whose key is gone has certified all its clients for nothing."""
    (tmp_path / there).write_text("precious")
    with pytest.raises(FileExistsError):
        store(ca, tmp_path, "ca")
    assert (tmp_path / there).read_text() == "precious"


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


def test_a_ca_with_another_s_key_signs_nothing(ca: Signed, tmp_path: Path) -> None:
    store(ca, tmp_path, "ca")
    assert load_ca(tmp_path).certificate == ca.certificate
    store(make_ca(30), tmp_path, "other")
    (tmp_path / "other.key").replace(tmp_path / "ca.key")
    with pytest.raises(ValueError, match=r"ca\.key does not fit ca\.crt"):
        load_ca(tmp_path)
