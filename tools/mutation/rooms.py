"""The rooms that are mutated: what is changed, and which tests near it must notice."""

from typing import Final, NamedTuple


class Room(NamedTuple):
    """sources: folders or files below gateway/; tests: below tests/, the nearest first."""

    sources: tuple[str, ...]
    tests: tuple[str, ...]


_IN_EVERY_STATE = "service/edge_table"
ROOMS: Final = {
    "control": Room(("control",), ("control", _IN_EVERY_STATE, "faults/test_control_reactions.py",
                                   "faults/test_first_cause_and_reset.py", "faults/test_wrong_cells.py")),
    "registers": Room(("registers",), ("registers", "fuzz/test_fuzz_modbus.py", _IN_EVERY_STATE)),
    "fieldbus": Room(("fieldbus", "modbus"),
                     ("modbus", "fieldbus", "registers/test_framing_refusals.py", "fuzz/test_fuzz_modbus.py")),
    "devices": Room(("devices",), ("devices", "dialogues", "fuzz/test_fuzz_codecs.py")),
    "coefficients": Room(
        ("bsfm/validate.py", "bsfm/validate_dynamics.py", "bsfm/exact_polynomials.py"),
        ("bsfm/test_validate_coefficients.py", "bsfm/test_validate_dynamics.py",
         "bsfm/test_exact_polynomials.py", "bsfm/test_curve_reference.py",
         "registers/bank/test_staging.py", "registers/test_staged_set.py"),
    ),
}  # fmt: skip
