"""The shipped map against the list that masters rely on, and what a wrong map is told."""

import json
from copy import deepcopy

import pytest

from gateway.registers import MapError, UnknownRegister
from gateway.registers.map.map_reader import read_map
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


FROZEN = {
    "control_word": """
        0:enable 1:reset_fault 2:tare 3:take_ownership 4:valve_pull 5:start_calibration 6:start_self_test
    """,
    "mode": "0:force 1:voltage",
    "status_word": "0:enabled 1:ready 2:contact 3:in_band 4:fault 5:warning 6:limited 7:target_unreachable",
    "state": "0:off 1:ready 2:ramping 3:holding 4:fault 5:calibrating",
    "limited_by": """
        0:none 1:voltage_slew 2:voltage_range 3:trim_range 4:calibration_range 5:force_range 6:smallest_force
    """,
    "fault_code": """
        0:none 1:master_lost 2:sample_stale 3:sample_frozen 4:over_force 5:sign_inverted 6:gain_wrong
        7:output_silent 8:output_refused 9:output_altered 10:output_lost 11:cell_lost 12:loop_stalled
        13:not_finite 14:internal 15:model_invalid 16:machine_busy
    """,
    "warning_word": """
        0:restarted 1:target_unreachable 2:trim_saturated 3:serial_noise 4:slow_loop 5:no_watchdog
        6:clock_fallback 7:master_lost 8:model_differs 9:compensation_worse
        10:force_unsteady
    """,
    "refusal_reason": """
        0:none 1:address 2:read_only 3:half_value 4:not_finite 5:out_of_range 6:words_swapped 7:too_small
        8:reserved 9:not_owner 10:role 11:fault_latched 12:not_ready 13:output_fault 14:cell_silent
        15:reset_needs_zero 16:unsupported_bit 17:byte_order_unproven 18:busy 19:quantity 20:function
        21:coefficients 22:heartbeat_stale 23:nothing_to_reset 24:tare_refused 25:calibration_refused
        26:calibrating 27:fitting 28:calibration_held 29:stopping 30:empty_slot 40:unit
    """,
    "calibration_phase": """
        0:idle 1:zero 2:check 3:ladder 4:minor_loops 5:fitting 6:stored 7:stopped 8:refused 9:experiment
        10:recorded
    """,
    "commit": "0:none 1:commit 2:dry_run 3:rollback",
    "commit_status": "0:idle 1:checking 2:writing 3:committed 4:failed",
    "failing_reason": """
        0:none 1:not_finite 2:handle_range 3:weight_range 4:words_swapped 5:not_increasing 6:slope_floor
        7:crossing 8:voltage_range 9:order 10:blend_span 11:slip_stops 12:slip_radius 13:slip_share
        14:slip_stiffness 15:response 20:length 21:crc 22:unused_not_zero 23:target_slot 24:force_limits
        25:storage 26:not_stored 27:defect 28:stops_cut
    """,
    "commit_notice": "0:without_stops 1:known_set",
}
"""Numbers of version 2 that masters are programmed by. They may be added to, and never move."""


@pytest.mark.parametrize("name", FROZEN)
def test_numbers_that_masters_rely_on_stay_in_a_version(register_map, name):
    assert register_map.version == 2
    register = register_map.find(name)
    promised = dict(pair.split(":") for pair in FROZEN[name].split())
    found = {str(number): meaning for number, meaning in (register.values or register.bits).items()}
    assert promised.items() <= found.items()


def test_residual_causes_are_named_in_the_map(register_map):
    assert register_map.find("residual_cause").values == {cause.value: cause.name.lower() for cause in ResidualCause}


def test_a_map_names_the_programs_own_enumerations_or_lists_its_own():
    document = small()
    (setpoint, _) = document["blocks"]["only"]["registers"]
    setpoint["values"] = "state"
    assert read_map(document).find("setpoint@only").values[5] == "calibrating"
    setpoint["values"] = {5: "five"}
    assert read_map(document).find("setpoint@only").values == {5: "five"}
    setpoint["values"], setpoint["bits"] = "stat", "status_wrd"
    with pytest.raises(MapError, match=r"stat is not one of .* did you mean state.*did you mean status_word"):
        read_map(document)


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
        ("voltage", "did you mean voltage_setpoint or output_voltage?"),
        ("force", "force_ramp or precontact_force or force_measured or"),  # it was force_low, of the staging block
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


def test_the_hash_sees_numbers_and_neither_texts_nor_names(document):
    """A client commands nothing of another map: one new fault code of an update must not stop every robot."""
    reworded, renamed = deepcopy(document), deepcopy(document)
    reworded["blocks"]["command"]["registers"][1]["text"] = "Something else"
    fault = next(one for one in renamed["blocks"]["status"]["registers"] if one["name"] == "fault_code")
    fault["values"] = {0: "none", 999: "one_more"}
    before = read_map(document).map_hash
    assert read_map(reworded).map_hash == before
    assert read_map(renamed).map_hash == before
    for key, number in (("scale", 0.1), ("min", 0.5), ("max", 9.0), ("constant", 3), ("access", "R")):
        changed = deepcopy(document)
        changed["blocks"]["command"]["registers"][1][key] = number
        assert read_map(changed).map_hash != before, key


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
    ({"bits": {15: "a", 16: "b"}}, "^[^;]*: 16: b is not a number 0 .. 15[^;]*$"),
    ({"address": True}, "True is not a whole number"),
    ({"text": 3}, "text is not text"),
    ({"max": True}, "True is not a number"),
    ({"max": float("nan")}, "nan is not a number"),
]


@pytest.mark.parametrize(("change", "sentence"), LIES)
def test_a_wrong_map_is_told_where_and_why(change, sentence):
    document = small()
    read_map(document)
    document["blocks"]["only"]["registers"][0] |= change
    with pytest.raises(MapError, match=sentence):
        read_map(document)


@pytest.mark.parametrize(
    ("base", "is_fitting"), [(198, False), (199, False), (200, True), (264, True), (265, False), ("200", False)]
)
def test_a_float_block_repeats_what_fits_into_it_to_the_last_word(document, base, is_fitting):
    changed = deepcopy(document)
    changed["blocks"]["float_abcd"]["repeats"] = {"command": base}
    if is_fitting:
        assert read_map(changed).block("float_abcd").repeats == {"command": base}
        return
    with pytest.raises(MapError) as caught:
        read_map(changed)
    assert [sentence for _, sentence, *_ in caught.value.faults] == [
        f"{base} .. does not fit in float_abcd, 200 .. 295"
    ]


def test_limits_that_a_register_cannot_carry_are_refused_at_the_edge(document):
    changed = deepcopy(document)
    ramp = changed["blocks"]["command"]["registers"][2]
    ramp["max"] = 3276.8  # 32768 counts of 0.1 N/s
    with pytest.raises(MapError) as caught:
        read_map(changed)
    assert [sentence for _, sentence, *_ in caught.value.faults] == ["3276.8 does not fit in int16 with scale 0.1"]
    ramp["max"] = 3276.7
    assert read_map(changed).find("force_ramp").maximum == 3276.7
    (open_ended := small())["blocks"]["only"]["registers"][1]["max"] = 1.0
    assert (read := read_map(open_ended).find("measured")).maximum == 1.0 and read.minimum is None


def test_every_fault_is_told_at_once_with_its_place():
    document = small() | {"version": 0}
    document["blocks"]["only"]["registers"][0]["access"] = "W"
    document["blocks"]["only"]["registers"][1]["text"] = 3
    document["blocks"]["twin"] = {"first": 9, "last": 20, "repeats": {"onyl": 9}}
    document["blocks"]["third"] = {"first": 30, "last": 31, "registers": {}, "txet": ""}
    with pytest.raises(MapError) as caught:
        read_map(document)
    assert [(fault.place, fault.is_of_key) for fault in caught.value.faults] == [
        (("blocks", "third", "txet"), True),
        (("blocks", "twin"), False),
        (("blocks", "only", "registers", 0, "access"), False),
        (("blocks", "only", "registers", 1, "text"), False),
        (("blocks", "third", "registers"), False),
        (("blocks", "twin", "repeats", "onyl"), False),
        (("version",), False),
    ]
    assert "twin: starts at 9 inside block only, which ends at 9" in str(caught.value)


def test_a_document_that_is_no_map_is_told_so():
    with pytest.raises(MapError, match="blocks: is missing; map: name is missing; map: version is missing"):
        read_map({})
    with pytest.raises(MapError, match="is not a group of keys"):
        read_map({"name": "x", "version": 1, "blocks": [1]})


def test_reading_the_map_again_from_json_changes_nothing(document, register_map):
    again = read_map(json.loads(json.dumps(document)))
    assert again == register_map
    assert again.map_hash == register_map.map_hash
