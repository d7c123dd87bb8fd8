"""The way from the terminal to a gateway by Modbus/TCP Security: Modbus TCP by TLS, with a certificate of one's own."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from gateway.cli.errors import CliError
from gateway.cli.master.wires import NETWORK_CUT, TIMEOUT_S, TcpWire
from gateway.modbus.certificate import HAS_EXPIRED, KEY_MISMATCHES, NOT_YET_VALID
from gateway.plain_file import check_plain
from gateway.processes import exit_codes

if TYPE_CHECKING:
    import socket
    import ssl

    from pymodbus.client import ModbusTcpClient

_ASK_LOG = "its log (force-gateway events on its machine) says which"
_WEAK = ("EE_KEY_TOO_SMALL", "CA_KEY_TOO_SMALL", "CA_MD_TOO_WEAK")


@dataclass(frozen=True, slots=True)
class TlsFiles:
    """Paths of PEM files: the CA that signed the gateway's certificate, and the client's own certificate and key."""

    ca: Path
    certificate: Path
    key: Path


@dataclass(frozen=True, slots=True)
class TlsWire(TcpWire):
    """Modbus TCP by TLS 1.2 or 1.3."""

    files: TlsFiles

    def is_served_by(self, running: dict[str, object]) -> bool:
        """Decide that it is not known: what a gateway tells of itself is its plain port."""
        return False

    def connect(self) -> "ModbusTcpClient":
        """Return a connected client; CliError for files that cannot be used (E171, E172, E174) and for a gateway that
        is not there or not the one that it should be (E130, E176)."""
        from pymodbus.client import ModbusTlsClient

        context = self._context()
        client = ModbusTlsClient(self.host, sslctx=context, port=self.port, timeout=TIMEOUT_S, retries=0)
        client.socket = self._shake_hands(context, self._open())
        return client

    def _context(self) -> "ssl.SSLContext":
        import ssl

        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        for file in (self.files.ca, self.files.certificate, self.files.key):
            try:
                check_plain(file)
                file.read_bytes()
            except OSError as error:
                raise CliError(f"E171 {file}: {error.strerror or error}", exit_codes.DATA) from None
        try:
            context.load_verify_locations(self.files.ca)
            context.load_cert_chain(self.files.certificate, self.files.key, password=lambda: b"")
        except (ssl.SSLError, OSError, ValueError) as error:
            raise CliError(
                self._unfit((isinstance(error, ssl.SSLError) and error.reason) or ""), exit_codes.DATA
            ) from None
        return context

    def _unfit(self, reason: str) -> str:
        """Return what is wrong with the files. reason: OpenSSL's."""
        ca, certificate, key = self.files.ca, self.files.certificate, self.files.key
        if reason in KEY_MISMATCHES:
            return f"E172 {key} does not fit {certificate}: take the two made together"
        if b"ENCRYPTED" in key.read_bytes():
            return f"E174 {key} has a password, and nobody is asked for it: openssl pkey -in {key} -out NEW.key takes it off"
        if reason in _WEAK:
            why = reason.lower().replace("_", " ")
            return f"E174 {certificate} is refused by this machine's OpenSSL ({why}): make one with a stronger key"
        for file in (ca, certificate):
            if not _has_certificates(file):
                return f"E174 {file} is no PEM file with a certificate"
        return f"E174 {key} is no PEM file with a private key"

    def _shake_hands(self, context: "ssl.SSLContext", plain: "socket.socket") -> "socket.socket":
        import ssl

        try:
            return context.wrap_socket(plain, server_hostname=self.host.strip("[]"))
        except ssl.SSLCertVerificationError as error:
            why = f"the certificate of {self.where} is not to be trusted: {error.verify_message.rstrip('.')}"
            cure = "give --tls the CA that has signed it, and --gateway a name that is in it (certs --host)"
            if error.verify_code in (NOT_YET_VALID, HAS_EXPIRED):
                cure = "look at the clocks of both machines, or make new ones there (force-gateway certs)"
            raise CliError(f"E176 {why}; {cure}", exit_codes.DEVICE) from None
        except OSError as error:
            reason = error.reason if isinstance(error, ssl.SSLError) else error.strerror
            if isinstance(error, TimeoutError):
                reason = f"no answer within {TIMEOUT_S:g} s"
            why = f"no TLS with {self.where}: {(reason or 'the connection ended').lower().replace('_', ' ')}"
            raise CliError(f"E176 {why}; is this the port of its line `modbus tls`?", exit_codes.DEVICE) from None

    def no_answer(self, unit: int, error: Exception, *, has_answered: bool) -> CliError:
        """Return E176: with TLS 1.3 a client learns with its first request only that its certificate was refused."""
        from pymodbus.exceptions import ConnectionException

        is_closed = isinstance(error, (OSError, ConnectionException))
        cause = "closed the connection" if is_closed else f"did not answer unit {unit} within {TIMEOUT_S:g} s"
        if has_answered:
            return self._lost(cause, f"refuses {self.files.certificate} by now" if is_closed else NETWORK_CUT)
        if is_closed:
            why = "another CA, expired, no role in it, or revoked"
            text = f"E176 {self.where} {cause}: it probably refuses {self.files.certificate} ({why}); {_ASK_LOG}"
            return CliError(text, exit_codes.DEVICE)
        return CliError(f"E131 {self.where} {cause}", exit_codes.DEVICE)


def _has_certificates(file: Path) -> bool:
    """Return whether OpenSSL finds a certificate in a PEM file."""
    import ssl

    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT).load_verify_locations(file)
    except OSError:  # what OpenSSL says, too
        return False
    return True
