"""A key with a password, put in the place of the face's while the gateway runs: an error, and no question."""

import ssl
import subprocess
import sys
from pathlib import Path

import pytest
from cryptography.hazmat.primitives import serialization

from tests.certificates import Folder

LOAD = """\
import sys
from gateway.fieldbus import ServerSettings, TlsSettings
from gateway.fieldbus.tls_settings import context_maker
context_maker(TlsSettings(ServerSettings(), *sys.argv[1:]))()
"""


@pytest.mark.parametrize("kind", ["PKCS8", "TraditionalOpenSSL"])
def test_nobody_is_asked_for_a_password(folder: Folder, tmp_path: Path, kind: str) -> None:
    """`Enter PEM pass phrase:` stood among the lines of the log, twice every 5 s, and nothing that was typed was read."""
    key = serialization.load_pem_private_key(Path(folder.key("gateway")).read_bytes(), None)
    form, locked = getattr(serialization.PrivateFormat, kind), serialization.BestAvailableEncryption(b"secret")
    (tmp_path / "locked.key").write_bytes(key.private_bytes(serialization.Encoding.PEM, form, locked))
    done = subprocess.run(
        [sys.executable, "-c", LOAD, folder.crt("gateway"), tmp_path / "locked.key", folder.crt("ca")],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        start_new_session=True,  # as the control process, which has no terminal of its own
        timeout=60,
        check=False,
    )
    assert done.returncode == 1 and ssl.SSLError.__name__ in done.stderr
    assert "pass phrase" not in done.stderr + done.stdout
