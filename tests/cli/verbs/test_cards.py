"""One effect, one register on a card: everything that the catalogue and the map say of it, whole at any width."""

import json
import re
from dataclasses import replace

import pytest

from gateway.catalogue.all_effects import EFFECTS
from gateway.cli.cards.effect_card import effect_facts
from gateway.cli.cards.register_card import register_facts
from gateway.registers import RegisterMap


def words_of(text: str) -> str:
    """The text with all breaks gone: a word may be folded anywhere on a narrow terminal."""
    return re.sub(r"\s+", "", text)


@pytest.mark.parametrize("width", [60, 80])
def test_an_effects_card_has_every_fact_whole(width: int, call) -> None:
    for name in ("leak", "tilt-gravity", "coulomb-friction"):
        effect = next(effect for effect in EFFECTS if effect.name == name)
        answer = call("effects", name, env={"COLUMNS": str(width)})
        assert answer.exit_code == 0, answer.output
        assert max(map(len, answer.output.splitlines())) <= width
        facts = [effect.what, effect.signature, effect.experiment, effect.excitation, *effect.group[:0]]
        assert [fact for fact in facts if words_of(fact) not in words_of(answer.output)] == []
        assert all(words_of(parameter.path) in words_of(answer.output) for parameter in effect.parameters)


def test_every_effect_says_how_it_is_shown_and_what_control_does() -> None:
    for effect in EFFECTS:
        facts = dict(effect_facts(effect))
        assert all(facts[keyword] for keyword in ("what", "signature", "to show it", "experiment", "control")), (
            effect.name
        )
        assert "compensated" in facts["control"]


def test_a_registers_card_has_its_numbers_by_every_name(call) -> None:
    answer = call("registers", "force_measured", env={"COLUMNS": "60"})
    assert answer.exit_code == 0, answer.output
    flat = words_of(answer.output)
    for words in (
        "40103 (holding)",
        "102, counted from 0 (0x0066)",
        "int16, times 0.01 N",
        "read only",
        "-r 103 -c 1 HOST",
    ):
        assert words_of(words) in flat, words
    assert (
        call("registers", "40103").output
        == call("registers", "102").output
        == call("registers", "force_measured").output
    )


def test_every_register_has_a_card_whose_lines_name_it(register_map: RegisterMap) -> None:
    for register in register_map.registers:
        facts = dict(register_facts(register_map, register))
        named = facts["read"].removeprefix("force-gateway read ")
        assert register_map.find(named) is register
        assert facts["what"]
        assert f"-r {register.address + 1} " in facts["mbpoll"]
        if "write" in facts:
            label, _, value = facts["write"].removeprefix("force-gateway write ").partition("=")
            assert (label, bool(value)) == (named, True)


def test_the_lines_of_a_card_name_a_map_of_one_s_own(register_map: RegisterMap) -> None:
    """Without it they are refused: E186."""
    facts = dict(register_facts(replace(register_map, file="own.yaml"), register_map.find("heartbeat")))
    assert facts["read"] == "force-gateway read heartbeat --map own.yaml" and facts["write"].endswith(" --map own.yaml")


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (("effects", "leek"), "did you mean leak?"),
        (("effects", "friction"), "coulomb-friction"),
        (("registers", "force_setpiont"), "did you mean force_setpoint"),
        (("registers", "force"), "did you mean force_setpoint or "),
        (("registers", "49999"), "force-gateway registers lists them"),
        (("registers", "trim", "--format", "scl"), "of the whole map"),
    ],
)
def test_an_unknown_name_is_answered_with_the_nearest(words: tuple[str, ...], meant: str, call) -> None:
    answer = call(*words)
    assert answer.exit_code == 2
    assert meant in answer.stderr


def test_the_same_as_json(call) -> None:
    effect = json.loads(call("effects", "leak", "--json").output)
    assert (effect["name"], effect["treatments"][0]["by"]) == ("leak", "nothing")
    register = json.loads(call("registers", "force_setpoint", "--format", "json").output)
    assert (register["address"], register["unit"], register["max"]) == (1, "N", 327.67)
    assert len(json.loads(call("registers", "dead_time", "--format", "json").output)) == 2
