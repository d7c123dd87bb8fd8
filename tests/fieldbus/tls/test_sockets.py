"""Modbus/TCP Security over real sockets, on the stock loop: foreign clients, and one that says nothing."""

import asyncio
import contextlib
import shutil
import ssl
import subprocess
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from pymodbus.client import AsyncModbusTlsClient

from gateway.fieldbus import ModbusTlsServer, ServerSettings, TlsSettings, tls_server
from gateway.fieldbus.tls_settings import HANDSHAKE_S
from gateway.modbus import Peer
from gateway.modbus.certificate import read_certificates
from gateway.modbus.expiry import CURES, day_of
from tests.certificates import Folder
from tests.fieldbus.by_hand import READ, READ_ANSWER, framed
from tests.fieldbus.conftest import HandClock, NotingBank
from tests.fieldbus.tls.by_hand import client

READ_TWO = framed(READ, 7)


def test_foreign_clients_speak_with_it(folder: Folder) -> None:
    """pymodbus by TLS, and OpenSSL's own client; over a socket, on the stock loop."""

    async def main() -> None:
        bank, closed, log = NotingBank(), list[Peer](), list[str]()
        server = ModbusTlsServer(
            bank,
            TlsSettings(ServerSettings(), folder.crt("gateway"), folder.key("gateway"), folder.crt("ca")),
            on_peer_closed=closed.append,
            log=lambda cause, sentence: log.append(sentence),
        )
        _, port = await server.start("127.0.0.1", 0)
        master = AsyncModbusTlsClient("127.0.0.1", port=port, sslctx=unnamed(client(folder, "admin")), retries=0)
        assert await master.connect()
        assert not (await master.write_registers(3, [7, 8])).isError()
        assert (await master.read_holding_registers(3, count=2)).registers == [7, 8]
        assert bank.writes[0][2].identity == "certificate admin"
        master.close()
        await ask_with_openssl(folder, port)
        await server.close()
        assert not server._handshakes.pending and log == []

    asyncio.run(asyncio.wait_for(main(), 20.0))


def test_a_server_cuts_who_connects_and_says_nothing(folder: Folder) -> None:
    async def main() -> None:
        clock, log = HandClock(), list[str]()
        files = TlsSettings(ServerSettings(), folder.crt("gateway"), folder.key("gateway"), folder.crt("ca"))
        server = ModbusTlsServer(
            NotingBank(), files, on_peer_closed=list[Peer]().append, log=lambda _, told: log.append(told), clock=clock
        )
        reader, writer = await asyncio.open_connection(*await server.start("127.0.0.1", 0))
        while not server._handshakes.pending:
            await asyncio.sleep(0.001)
        clock.advance(HANDSHAKE_S + 0.5)
        with contextlib.suppress(ConnectionResetError):
            assert await reader.read() == b""
        assert not server._handshakes.pending and log[0].startswith("W243 ")
        writer.close()
        await server.close()

    asyncio.run(asyncio.wait_for(main(), 20.0))


def test_an_end_of_the_face_cuts_who_is_shaking_hands(folder: Folder) -> None:
    async def main() -> None:
        files = TlsSettings(ServerSettings(), folder.crt("gateway"), folder.key("gateway"), folder.crt("ca"))
        server = ModbusTlsServer(NotingBank(), files, on_peer_closed=list[Peer]().append, log=lambda *_: None)
        reader, writer = await asyncio.open_connection(*await server.start("127.0.0.1", 0))
        while not server._handshakes.pending:
            await asyncio.sleep(0.001)
        await server.close()
        with contextlib.suppress(ConnectionResetError):
            assert await reader.read() == b""
        assert not server._handshakes.pending
        writer.close()

    asyncio.run(asyncio.wait_for(main(), 5.0))


def unnamed(context: ssl.SSLContext) -> Any:
    context.check_hostname = False
    return context


async def ask_with_openssl(folder: Folder, port: int) -> None:
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed")
    words = ["s_client", "-quiet", "-connect", f"127.0.0.1:{port}", "-CAfile", folder.crt("ca")]
    words += ["-cert", folder.crt("setpoint"), "-key", folder.key("setpoint")]
    process = await asyncio.create_subprocess_exec(
        "openssl", *words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert process.stdin and process.stdout
    process.stdin.write(READ_TWO)
    await process.stdin.drain()
    assert await process.stdout.readexactly(len(framed(READ_ANSWER, 7))) == framed(READ_ANSWER, 7)
    process.stdin.close()
    process.kill()
    await process.wait()


def test_a_gateway_that_runs_for_years_tells_when_its_certificate_is_about_to_end(
    folder: Folder, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A start tells it of what ends soon; nobody had been told where it ran on into the last month."""
    certificate, authority = folder.crt("gateway"), folder.crt("ca")
    ends = read_certificates(Path(certificate).read_bytes())[0].ends
    day_before = (datetime.strptime(ends, "%Y%m%d%H%M%S%z") - timedelta(days=1)).strftime("%Y%m%d%H%M%SZ")

    async def main(*moments: str) -> list[tuple[str, str]]:
        """What is told at these moments, each given by what it is 30 days later."""
        clock, log, now = HandClock(), list[tuple[str, str]](), [moments[0]]
        files = TlsSettings(ServerSettings(), certificate, folder.key("gateway"), authority)
        monkeypatch.setattr(tls_server, "_utc", lambda days=0: now[0])
        server = ModbusTlsServer(
            NotingBank(), files, on_peer_closed=list[Peer]().append, log=lambda *said: log.append(said), clock=clock
        )
        await server.start("127.0.0.1", 0)
        for now[0] in moments:
            clock.advance(3600.0)
        await server.close()
        return log

    told = asyncio.run(main(day_before, day_before, ends))
    assert [cause.split()[0] for cause, _ in told] == ["certificate"] * 2, "what the event is about"
    named = (("certificate", certificate), ("ca", authority))
    assert [said for _, said in told] == [
        f"W246 {file} expires on {day_of(ends)}: {CURES[name]}" for name, file in named
    ]
    assert asyncio.run(main(ends, ends)) == [], "its start has told it"
