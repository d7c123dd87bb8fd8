"""A number in place of a name: whose it is, by its address or as PLCs count."""

import pytest

from gateway.profiles import load_register_map
from gateway.registers import UnknownRegister
from gateway.registers.map.map_reader import read_map
from tests.registers.test_register_map import small


@pytest.mark.parametrize(
    ("number", "name"),
    [("40103", "force_measured"), ("30103", "force_measured"), ("102", "force_measured"), ("40001", "control_word")],
)
def test_a_number_for_a_name_says_whose_it_is(number, name):
    register_map = load_register_map("force-v1")
    with pytest.raises(
        LookupError, match=f"{number} is not a register by name: {number} is the .* of {name}, so use {name}"
    ):
        register_map.find(number)


def test_a_plc_numbers_words_with_five_digits_from_40001_to_49999():
    document = small()
    document["blocks"]["far"] = {"first": 9998, "last": 50000, "registers": []}
    for address in (9998, 9999, 50000):
        far = {"name": f"far_{address}", "address": address, "type": "int16", "text": "c"}
        document["blocks"]["far"]["registers"].append(far)
    register_map = read_map(document)
    for number, address in (("49999", 9998), ("9999", 9999), ("50000", 50000)):
        with pytest.raises(UnknownRegister, match=f"of far_{address}, so"):
            register_map.find(number)
