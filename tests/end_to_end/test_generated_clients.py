"""The generated clients against a running gateway: C and Python as they stand, the others by the frames that they make."""

from __future__ import annotations

import shlex
import shutil
import socket
import struct
import subprocess
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from gateway.clients import Endpoint, render_client
from gateway.clients.wiring import wiring_page
from gateway.profiles import load_register_map, load_rig
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.s7 import S7
from tests.clients.programs.controllers.structured_text import Codesys
from tests.clients.programs.controllers.universal_robot import UniversalRobot

MAP = load_register_map("force-v1")
MAIN = r"""
#define FORCE_GATEWAY_IMPLEMENTATION
#include "force_gateway.h"
#include <stdlib.h>

static void show(const char *name, const uint8_t *bytes, size_t count) {
    printf("%s ", name);
    for (size_t k = 0; k < count; k++) printf("%02x", bytes[k]);
    printf("\n");
}

static int run(fg_client *g, int until_held) {
    const struct timespec pause = {0, 5000000};
    for (int k = 0; k < 4000; k++) {
        int result = fg_exchange(g);
        if (result != FG_OK || !until_held || (g->status.state == FG_STATE_HOLDING && g->status.in_band)) return result;
        nanosleep(&pause, NULL);
    }
    return FG_FAILED;
}

int main(int argc, char **argv) {
    fg_client g;
    fg_model model;
    uint16_t words[FG_SET_WORDS], again[FG_SET_WORDS], echo[2] = {0x5000, 0x449A};
    uint8_t frame[260];
    int result;
    if (argc < 2) return 9;
    fg_init(&g, "localhost", (uint16_t)atoi(argv[1]), 1); /* ::1 first, where there is IPv6 */
    g.timeout_ms = 10000;
    printf("crc %08lX\n", (unsigned long)fg_crc32((const uint8_t *)"123456789", 9));
    fg_enable(&g, 12.0f);
    show("exchange", frame, fg_frame_exchange(frame, 258, 1, FG_COMMAND_FIRST, FG_COMMAND_WORDS, g.want));
    show("read", frame, fg_frame_read(frame, 258, 1, FG_STATUS_FIRST, FG_STATUS_WORDS));
    show("write", frame, fg_frame_write(frame, 258, 1, 0, 2, g.want));
    fg_write(&g, 416, 2, echo);
    result = run(&g, 1);
    printf("held %d %.0f %u\n", result, (double)g.status.force_requested, g.status.enabled);
    fg_read(&g, 416, 2, echo);
    printf("echo %04X%04X\n", echo[0], echo[1]);
    printf("range %d\n", fg_force(&g, 400.0f));
    fg_force(&g, 65.0f);
    result = run(&g, 0);
    printf("refused %d %s\n", result, g.message);
    result = run(&g, 0);
    printf("still %d %.0f %u %u\n", result, (double)g.status.force_requested, g.status.enabled, g.ended);
    shutdown(g.socket, SHUT_RDWR);
    printf("lost %d\n", fg_exchange(&g));
    while ((result = fg_exchange(&g)) == FG_LOST) {}
    printf("back %d %u %u\n", result, g.status.enabled, g.ended);
    fg_enable(&g, 5.0f);
    fg_exchange(&g);
    fg_close(&g);
    fg_force(&g, 6.0f);
    result = fg_exchange(&g);
    printf("closed %d %u %u\n", result, g.status.enabled, g.ended);
    result = fg_read_active(&g, &model, words);
    fg_model_words(&model, again);
    printf("active %d %d\n", result, memcmp(words, again, sizeof words));
    show("set", (const uint8_t *)words, sizeof words);
    result = fg_stage(&g, &model, 0);
    if (result == FG_OK) result = fg_commit(&g);
    while (result == FG_OK && (result = fg_commit_state(&g)) == FG_WORKING) result = FG_OK;
    printf("committed %d\n", result);
    model.rising_w[0] = -1.0f;
    fg_stage(&g, &model, 0);
    fg_commit(&g);
    while ((result = fg_commit_state(&g)) == FG_WORKING) {}
    printf("bad %d %s\n", result, g.message);
    fg_close(&g);
    return 0;
}
"""
SAID = """crc CBF43926
held 0 12 1
echo 449A5000
range 3
refused 1 refused: W204 value out of range (exception 3, address 1, value 65)
still 0 12 1 0
lost 2
back 0 0 1
closed 0 0 1
active 0 0
committed 0
bad 4 commit failed at number 16: weight range""".splitlines()


def rendered(language: str, port: int) -> str:
    return render_client(MAP, language, Endpoint("127.0.0.1", port, 1))


def python_client(folder: Path, port: int) -> ModuleType:
    module = ModuleType("force_gateway")
    exec(compile(rendered("python", port), str(folder / "force_gateway.py"), "exec"), module.__dict__)
    return module


def test_the_c_client_compiles_without_a_warning_and_does_all_of_it(rested: Any, tmp_path: Path) -> None:
    if not shutil.which("gcc"):
        pytest.skip("no C compiler: Debian package gcc. The generated C client was NOT tried")
    (tmp_path / "force_gateway.h").write_text(rendered("c", rested.port))
    (tmp_path / "main.c").write_text(MAIN)
    (tmp_path / "other.c").write_text('#include "force_gateway.h"\n')
    strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow"]
    built = subprocess.run(
        ["gcc", *strict, "main.c", "other.c", "-o", "client"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert built.returncode == 0, built.stderr
    done = subprocess.run(
        [tmp_path / "client", str(rested.port)], capture_output=True, text=True, check=False, timeout=60
    )
    frames = ("exchange", "read", "write", "set")
    assert [line for line in done.stdout.splitlines() if not line.startswith(frames)] == SAID
    of = dict(line.split(" ", 1) for line in done.stdout.splitlines())
    module = python_client(tmp_path, rested.port)
    want = [1, 1200, *([0] * 11)]
    assert of["exchange"] == module.exchange_frame(258, 1, 0, want).hex()
    assert of["read"] == module.read_frame(258, 1, 100, 32).hex()
    assert of["write"] == module.write_frame(258, 1, 0, want[:2]).hex()


def test_the_python_client_does_all_of_it(rested: Any, tmp_path: Path) -> None:
    module = python_client(tmp_path, rested.port)
    client = module.Client(timeout_s=10.0)
    assert client.exchange()["state"] == 0
    with pytest.raises(ValueError, match="allowed 0"):
        client.enable(400.0)
    client.write(416, (0x5000, 0x449A))
    client.enable(12.0)
    rested.wait_until(lambda _: client.exchange()["in_band"] and client.status["state"] == 3)
    assert client.read(416, 2) == (0x449A, 0x5000), "the client's own order, shown before its first command"
    assert client.status["force_requested"] == 12.0
    client.force(65.0)
    with pytest.raises(module.Refused, match=r"W204 value out of range .*address 1, value 65"):
        client.exchange()
    assert client.exchange()["force_requested"] == 12.0
    assert not rested.write(0, 0).isError(), "a stop by another connection"
    assert not client.exchange()["enabled"]
    assert client.ended
    client.enable(5.0)
    assert client.exchange()["enabled"]
    client._socket.shutdown(socket.SHUT_RDWR)
    with pytest.raises(module.Lost):
        client.exchange()
    assert client.status is None
    rested.wait_until(lambda _: back(client, module))
    assert client.ended and not client.status["enabled"]
    client.enable(5.0)
    assert client.exchange()["enabled"]
    client.close()
    client.force(6.0)
    assert not client.exchange()["enabled"] and client.ended, "closed: nothing is commanded until it is asked for again"
    model, words = client.read_active()
    assert module.model_to_words(model) == words
    client.stage(model)
    client.commit(within_s=30.0)
    with pytest.raises(module.Refused, match="number 16: weight range"):
        client.stage(model | {"rising_w": [-1.0]}) or client.commit(within_s=30.0)
    client.close()


def back(client: Any, module: ModuleType) -> bool:
    try:
        client.exchange()
    except module.Lost:
        return False
    return True


def requests_of(language: str, model: dict[str, Any]) -> list[bytes]:
    """What a controller sends for: enable 12 N, hold, off, upload a model."""
    gateway = GatewayAtHand(MAP)
    kinds: dict[str, Any] = {"rapid": Irc5, "scl": S7, "st": Codesys, "urscript": UniversalRobot}
    client = kinds[language](rendered(language, 5020), gateway)
    client.enable(12.0)
    for _ in range(3):
        client.cycle()
    client.disable()
    for _ in range(3):
        client.cycle()
    client.begin_upload(model, 0)
    for _ in range(12):
        client.cycle()
    assert client.uploaded, client.text
    return gateway.requests


def test_what_robots_and_plcs_send_is_taken_by_a_running_gateway(rested: Any, tmp_path: Path) -> None:
    module = python_client(tmp_path, rested.port)
    client = module.Client(timeout_s=10.0)
    model, _ = client.read_active()
    for language in ("rapid", "scl", "st", "urscript"):
        requests = requests_of(language, model)
        assert {23, 3, 16} - {23 if language == "scl" else 16} <= {request[0] for request in requests}
        with socket.create_connection(("127.0.0.1", rested.port), 5.0) as wire:
            for transaction, request in enumerate(requests):
                wire.sendall(struct.pack(">HHHB", transaction, 0, len(request) + 1, 255) + request)
                head = wire.recv(7, socket.MSG_WAITALL)
                body = wire.recv(int.from_bytes(head[4:6], "big") - 1, socket.MSG_WAITALL)
                assert head[:2] == struct.pack(">H", transaction)
                assert body[0] == request[0], f"{language}: {request.hex()} was answered by {body.hex()}"
        rested.wait_until(lambda _: client.read(1146, 1)[0] == 3, within_s=30.0)
        rested.rest()
    client.close()


def test_the_page_s_lines_for_mbpoll_work_as_they_stand(rested: Any) -> None:
    if not shutil.which("mbpoll"):
        pytest.skip("mbpoll is not installed (Debian package mbpoll). The wiring page's lines were NOT tried")
    _, sections = wiring_page(load_rig("demo"), "demo")
    lines = [line for each in sections for line in each.commands if line.startswith("mbpoll")]
    assert len(lines) == 5
    for line in lines:
        words = shlex.split(line, comments=True)
        words[words.index("-p") + 1] = str(rested.port)
        done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)
        assert done.returncode == 0, (line, done.stdout, done.stderr)
        if "enable" in line:
            assert rested.status()["force_requested"] == 1200
    assert rested.status()["status_word"] & 1 == 0
