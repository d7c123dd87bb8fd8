"""What an upload says of its registers to who programs a PLC, word by word."""

import struct

from gateway.cli.master.upload_frames import register_names
from gateway.registers import RegisterMap


def test_of_a_float_each_word_has_its_half_s_name_the_high_one_first(register_map: RegisterMap) -> None:
    """As the registers hold it: one that is typed in the other way round is another force."""
    names = register_names(register_map)
    span = register_map.find("blend_span@staging")
    assert (span.words, span.type) == (2, "float32")
    high, low = struct.unpack(">2H", struct.pack(">f", 2.0))
    assert span.encode(2.0) == struct.pack(">2H", high, low) and low == 0
    assert [names[span.address + place] for place in (0, 1)] == ["blend_span high word", "blend_span low word"]
    order = register_map.find("order@staging")
    assert (order.words, names[order.address]) == (1, "order")
