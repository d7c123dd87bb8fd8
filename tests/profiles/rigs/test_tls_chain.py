"""A gateway's certificate of an intermediate CA, as a plant's own PKI makes it: what is missing of the chain is named."""

from pathlib import Path

import pytest
from cryptography.hazmat.primitives import serialization

from gateway.cli.setup.certificates import make_ca, make_server, store
from gateway.modbus.certificate import read_certificates
from tests.profiles.rigs.test_tls_checks import ending, files, report, signed_by


@pytest.fixture
def plant(tmp_path: Path) -> Path:
    root = ending(make_ca(90), 90, path_length=None)
    between = signed_by(root, make_ca(90))
    store({"gateway": make_server(between, ("127.0.0.1",), 60), "between": between, "ca": root}, tmp_path)
    return tmp_path


def test_a_certificate_without_the_one_between_it_and_the_ca_wants_that_one(plant: Path) -> None:
    """It was said that it is not signed by the CA, and to make a new one."""
    (fault,) = report(plant, files()).faults
    told = str(fault)
    assert f"E175 {plant}/gateway.crt is of a CA that is not in the file of `ca`" in told
    assert "if it is one between the two, put its certificate behind this one, in the same file" in told


def test_with_the_one_between_behind_it_all_is_well(plant: Path) -> None:
    whole = (plant / "gateway.crt").read_bytes() + (plant / "between.crt").read_bytes()
    (plant / "gateway.crt").write_bytes(whole)
    assert list(report(plant, files()).faults) == []


def test_a_ca_that_another_has_signed_wants_that_one_in_its_file(tmp_path: Path) -> None:
    """It was said that the certificate is not signed by the CA of the face, which it is."""
    root, ca = ending(make_ca(90), 90, path_length=None), make_ca(90)
    ca = signed_by(root, ca)
    store({"gateway": make_server(ca, ("127.0.0.1",), 60), "ca": ca}, tmp_path)
    (fault,) = report(tmp_path, files()).faults
    assert f"E175 {tmp_path}/gateway.crt is of a CA that another one has signed, which the file of `ca` lacks" in str(
        fault
    )
    with (tmp_path / "ca.crt").open("ab") as file:
        file.write(root.certificate.public_bytes(serialization.Encoding.PEM))
    assert not report(tmp_path, files()).faults
    shown = read_certificates((tmp_path / "ca.crt").read_bytes())
    assert shown[0].issuer == shown[1].subject == shown[1].issuer != shown[0].subject
