"""Another model is filled, or sent, while one is on its way: never half of each, and none is told to be there that is not."""

from __future__ import annotations

from typing import Any

import pytest

from gateway.registers.upload.coefficients import words_of_block
from tests.clients.conftest import CONTROLLERS
from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.one_language.test_two_tasks import every_place
from tests.clients.programs.controllers.irc5 import Irc5
from tests.clients.programs.controllers.plc import Plc
from tests.clients.programs.controllers.universal_robot import UniversalRobot
from tests.clients.scenes import MODEL, TEXTS, cycles
from tests.clients.uploads.test_client_uploads import words_of

ANOTHER = MODEL | {"rising_b": [0.0, 25.0, 60.1], "falling_b": [0.5, 29.0, 60.3], "dead_time": 0.05, "lag": 0.1}
ONE, OTHER = words_of(MODEL), words_of(ANOTHER)
PARTS = pytest.mark.parametrize("parts", [1, 2, 3, 4])


@pytest.fixture(autouse=True)
def try_each_place_of_a_part_in_the_long_run(budget: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A part has a thousand statements, most of them of its sum."""
    monkeypatch.setattr("tests.clients.one_language.test_two_tasks.EVERY", 3 if budget > 1 else 37)


def keep_committed(gateway: GatewayAtHand) -> list[bytes]:
    """Return where each set that is committed will be noted."""
    commit, committed = gateway.bank.staging.on_commit, list[bytes]()

    def note(action: Any, words: bytes, peer: Any) -> None:
        committed.append(words_of_block(words))
        commit(action, words, peer)

    gateway.bank.staging.on_commit = note
    return committed


def send_parts(client: Any, gateway: GatewayAtHand, parts: int) -> None:
    while len(gateway.uploads) < parts:
        client.scan() if isinstance(client, Plc) else client.cycle()


@pytest.mark.sampled
@PARTS
@pytest.mark.parametrize("language", ["scl", "twincat", "codesys"])
def test_a_set_that_a_plc_fills_anew_while_one_is_sent_takes_no_part_in_that(
    language: str, parts: int, gateway: GatewayAtHand
) -> None:
    client: Any = CONTROLLERS[language](TEXTS[language], gateway)
    committed = keep_committed(gateway)
    client.begin_upload(MODEL, 3)
    send_parts(client, gateway, parts)
    client.begin_upload(ANOTHER, 3)
    cycles(client, 8)
    assert client.uploaded and committed == [ONE]


@PARTS
def test_an_irc5_that_fills_another_set_meanwhile_commits_none_and_says_so(parts: int, gateway: GatewayAtHand) -> None:
    """fgUpload FALSE and TRUE again within a cycle was not seen: the set of before was committed, and fgUploaded told of it
    as of the one that T_ROB1 had asked for last."""
    client = Irc5(TEXTS["rapid"], gateway)
    committed = keep_committed(gateway)
    client.begin_upload(MODEL, 3)
    send_parts(client, gateway, parts)
    client.set(fgUpload=False)
    client.begin_upload(ANOTHER, 3)
    cycles(client, 8)
    assert committed == [] and not client.uploaded and not client.get("fgUpload")
    assert "set fgUpload again" in client.text
    client.begin_upload(ANOTHER, 3)
    cycles(client, 8)
    assert committed == [OTHER] and client.uploaded


@pytest.mark.parametrize("change", ["set", "slot"])
def test_an_irc5_that_asks_for_another_behind_the_commit_is_told_which_one_is_there(
    change: str, gateway: GatewayAtHand
) -> None:
    client = Irc5(TEXTS["rapid"], gateway)
    committed = keep_committed(gateway)
    client.begin_upload(MODEL, 3)
    send_parts(client, gateway, 5)
    client.begin_upload(ANOTHER if change == "set" else MODEL, 3 if change == "set" else 4)
    cycles(client, 8)
    assert committed == [ONE] and not client.uploaded and not client.get("fgUpload")
    assert "committed" in client.text and "has changed since" in client.text


@PARTS
def test_a_universal_robot_sends_the_set_as_it_was_at_fg_upload(parts: int, gateway: GatewayAtHand) -> None:
    """The parts that were not sent yet were of what fg_model_number wrote meanwhile, their CRC-32 right."""
    client = UniversalRobot(TEXTS["urscript"], gateway)
    committed = keep_committed(gateway)
    client.begin_upload(MODEL, 3)
    send_parts(client, gateway, parts)
    client.machine.start("fg_model_number", client.get("FG_M_LAG"), 0.1)
    client.machine.start("fg_model_number", client.get("FG_M_FALLING_B"), 0.25)
    client.machine.start("fg_model_number", client.get("FG_M_RISING_B") + 2, 25.0)
    cycles(client, 8)
    assert client.uploaded and committed == [ONE]


@pytest.mark.sampled
@pytest.mark.parametrize("parts", [0, 1, 3, 4, 5])
def test_the_last_fg_upload_at_any_place_of_an_exchange_is_the_one_that_is_told_as_done(parts: int) -> None:
    """Called while an answer was awaited, its first part was counted as sent: half of each set was committed."""
    committed: list[list[bytes]] = []

    def prepare(client: Any, gateway: GatewayAtHand) -> None:
        committed.append(keep_committed(gateway))
        client.begin_upload(MODEL, 3)
        send_parts(client, gateway, parts)

    for client, _ in every_place("urscript", prepare, [lambda client: client.begin_upload(ANOTHER, 3)]):
        cycles(client, 10)
        assert client.uploaded and not client.get("fg_upload_wanted"), client.text
        assert committed[-1] in ([OTHER], [ONE, OTHER])
