"""The shipped map against FIELDBUS's list, and what a wrong map is told."""

import json
from copy import deepcopy

import pytest

from gateway.bsfm.validate import CoefficientReason
from gateway.registers import MapError, RegisterMap, UnknownRegister
from gateway.registers import words as w
from gateway.registers.residual_cause import ResidualCause
from gateway.registers.upload.coefficients import HEAD_WORDS, SET_WORDS, TAIL_FROM, UNUSED_WORDS

COMMAND = (
    "control_word force_setpoint force_ramp mode heartbeat voltage_setpoint tilt_angle precontact_force contact_ramp payload "
    "command_sequence in_band_tolerance in_band_time"
).split()
STATUS = (
    "status_word state force_measured force_requested force_accepted force_applied output_voltage feedforward trim limited_by "
    "fault_code warning_word sample_age loop_time heartbeat_echo sequence_echo owner_ip owner_ip refusal_address "
    "refusal_reason refusal_value refusal_value calibration_id model_residual pressure missed_ticks"
).split()
BLOCKS = {
    "command": (0, 15),
    "status": (100, 131),
    "float_abcd": (200, 295),
    "float_cdab": (300, 395),
    "proof": (400, 431),
    "staging": (1000, 1199),
    "active": (1500, 1699),
}
SCALES = {"s": 1, "N": 0.01, "N/s": 0.1, "mV": 1, "deg": 0.1, "ms": 1, "g": 1, "us": 1, "kPa": 1, "permille": 1, "": 1}


def test_blocks_are_those_of_the_contract(register_map):
    assert {block.name: (block.first, block.last) for block in register_map.blocks} == BLOCKS


@pytest.mark.parametrize(("block", "first", "names"), [("command", 0, COMMAND), ("status", 100, STATUS)])
def test_names_stand_at_the_offsets_of_the_contract(register_map, block, first, names):
    for offset, name in enumerate(names):
        register = register_map.find(name)
        assert register.block == block
        assert register.address <= first + offset < register.address + register.words


def test_float_blocks_repeat_command_and_status(register_map):
    for name in {*COMMAND, *STATUS} - {"owner_ip"}:
        plain = register_map.find(name)
        base = 200 + 2 * plain.address if plain.block == "command" else 232 + 2 * (plain.address - 100)
        for block, start in (("float_abcd", base), ("float_cdab", base + 100)):
            register = register_map.find(f"{name}@{block}")
            assert (register.address, register.type, register.words, register.scale) == (start, "float32", 2, 1.0)
            assert (register.unit, register.access) == (plain.unit, plain.access)
            assert register.word_order == block[-4:]


def test_owner_ip_is_not_carried_by_a_float(register_map):
    with pytest.raises(UnknownRegister, match="owner_ip@status"):
        register_map.find("owner_ip@float_abcd")


def test_int16_scales_follow_the_unit(register_map):
    for register in (*register_map.registers_of("command"), *register_map.registers_of("status")):
        assert register.scale == SCALES[register.unit], register.name


ENUMERATIONS = {
    "state": w.State,
    "mode": w.Mode,
    "limited_by": w.LimitedBy,
    "fault_code": w.FaultCode,
    "refusal_reason": w.RefusalReason,
    "calibration_phase": w.CalibrationPhase,
    "residual_cause": ResidualCause,
    "commit": w.CommitAction,
    "commit_status": w.CommitStatus,
}
FLAGS = {
    "control_word": w.ControlBit,
    "status_word": w.StatusBit,
    "warning_word": w.WarningBit,
    "commit_notice": w.CommitNotice,
}


@pytest.mark.parametrize("name", ENUMERATIONS)
def test_an_enumeration_is_the_same_in_map_and_code(register_map, name):
    assert register_map.find(name).values == {member.value: member.name.lower() for member in ENUMERATIONS[name]}


@pytest.mark.parametrize("name", FLAGS)
def test_bits_are_the_same_in_map_and_code(register_map, name):
    assert register_map.find(name).bits == {flag.value.bit_length() - 1: flag.name.lower() for flag in FLAGS[name]}


def test_failing_reasons_are_those_of_the_checks(register_map):
    reasons = {reason.value: reason.name.lower() for reason in (*CoefficientReason, *w.UploadReason)}
    assert register_map.find("failing_reason").values == reasons


def test_active_block_is_laid_out_like_staging(register_map):
    first = register_map.find("order@staging").address, register_map.find("order@active").address
    active = {register.name: register for register in register_map.registers_of("active")}
    staging = register_map.registers_of("staging")
    for staged in (register for register in staging if register.name in active):
        found = active.pop(staged.name)
        assert found.address - first[1] == staged.address - first[0]
        assert (found.type, found.unit, found.access) == (staged.type, staged.unit, "R")
    assert set(active) == {"active_slot", "commit_notice"}


def test_a_sets_words_are_the_registers_of_the_two_stretches_that_the_crc_covers(register_map):
    held = {
        register.address - 1000 + k for register in register_map.registers_of("staging") for k in range(register.words)
    }
    stretches = {*range(HEAD_WORDS), *range(TAIL_FROM, TAIL_FROM + SET_WORDS - HEAD_WORDS)}
    assert stretches - held == set(UNUSED_WORDS)
    assert len(stretches) == SET_WORDS == 190 and max(stretches) == 199
    assert f"{SET_WORDS}: 1000-1139, then 1150-1199. {HEAD_WORDS}:" in register_map.find("length@staging").text


def test_a_bare_name_means_the_int16_register(register_map):
    assert register_map.find("force_setpoint").address == 1
    assert register_map.find("force_setpoint@command") is register_map.find("force_setpoint")
    assert register_map.find("force_setpoint@float_cdab").address == 302
    assert register_map.find("map_version").address == 410


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("force_setpiont", "force_setpoint?"),
        ("Force_Setpoint", "force_setpoint?"),
        ("force_setpoint@float", "force_setpoint@float_abcd"),
        ("order", "order@staging or order@active"),
        ("xyzzy", "force-gateway registers lists them"),
    ],
)
def test_an_unknown_name_is_answered_with_what_was_meant(register_map, name, meant):
    with pytest.raises(UnknownRegister) as caught:
        register_map.find(name)
    assert meant in str(caught.value)


def test_values_survive_the_words(register_map):
    for register in register_map.registers:
        for value in (register.minimum, register.maximum, register.constant):
            if value is not None:
                assert register.decode(register.encode(value)) == pytest.approx(value, rel=1e-7)


def test_the_hash_sees_numbers_and_not_texts(document):
    changed, reworded = deepcopy(document), deepcopy(document)
    changed["blocks"]["command"]["registers"][1]["scale"] = 0.1
    reworded["blocks"]["command"]["registers"][1]["text"] = "Something else"
    before = RegisterMap.from_document(document).map_hash
    assert RegisterMap.from_document(reworded).map_hash == before
    assert RegisterMap.from_document(changed).map_hash != before


def small() -> dict:
    setpoint = {"name": "setpoint", "address": 0, "type": "int16", "access": "RW", "text": "a"}
    measured = {"name": "measured", "address": 1, "type": "float32", "text": "b"}
    blocks = {"only": {"first": 0, "last": 9, "registers": [setpoint, measured]}}
    return {"name": "small", "version": 1, "blocks": blocks}


LIES = [
    ({"address": 1}, "overlaps setpoint at 1|overlaps measured at 1"),
    ({"address": 10}, "outside block only, 0 .. 9"),
    ({"type": "int61"}, "int61 is not one of .* did you mean int16"),
    ({"name": "measured"}, "measured is there twice"),
    ({"name": "Set Point"}, "is not a name"),
    ({"scale": 0.3}, "0.3 is not 1, 0.1, 0.01 or 0.001"),
    ({"acess": "R"}, "acess: is not a known key; did you mean access"),
    ({"access": "W"}, "W is not R or RW"),
    ({"min": 5, "max": 4}, "min 5 is above max 4"),
    ({"max": 40000}, "40000 does not fit in int16"),
    ({"values": {"one": "a"}}, "one: a is not a number"),
    ({"bits": {16: "a"}}, "16: a is not a number 0 .. 15"),
    ({"address": True}, "True is not a whole number"),
    ({"text": 3}, "text is not text"),
]


@pytest.mark.parametrize(("change", "sentence"), LIES)
def test_a_wrong_map_is_told_where_and_why(change, sentence):
    document = small()
    RegisterMap.from_document(document)
    document["blocks"]["only"]["registers"][0] |= change
    with pytest.raises(MapError, match=sentence):
        RegisterMap.from_document(document)


def test_every_fault_is_told_at_once_with_its_place():
    document = small() | {"version": 0}
    document["blocks"]["only"]["registers"][0]["access"] = "W"
    document["blocks"]["twin"] = {"first": 5, "last": 20, "repeats": {"onyl": 5}}
    with pytest.raises(MapError) as caught:
        RegisterMap.from_document(document)
    assert [place for place, _ in caught.value.faults] == [
        ("blocks", "twin"),
        ("blocks", "only", "registers", 0, "access"),
        ("blocks", "twin", "repeats", "onyl"),
        ("version",),
    ]


def test_a_document_that_is_no_map_is_told_so():
    with pytest.raises(MapError, match="name is missing"):
        RegisterMap.from_document({})
    with pytest.raises(MapError, match="is not a group of keys"):
        RegisterMap.from_document({"name": "x", "version": 1, "blocks": [1]})


def test_reading_the_map_again_from_json_changes_nothing(document, register_map):
    again = RegisterMap.from_document(json.loads(json.dumps(document)))
    assert again == register_map
    assert again.map_hash == register_map.map_hash
