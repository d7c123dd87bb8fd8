"""Schedules that once broke a law, or were said to: a load cell that is cut, frozen, scaled, or talks in other units."""

from tests.simulation.draws.event import Event

KEPT: list[tuple[int, list[Event]]] = [
    (
        74244,
        [
            Event(10.3898, "world", "valve-stuck", (1.0,)),
            Event(20.265, "worker", "take", (43.39,), way="floats"),
            Event(20.4137, "worker", "hold", (55.62,)),
        ],
    ),
    (
        11927,
        [
            Event(3.779, "rival", "take", (57.21,), way="read_and_write"),
            Event(8.6198, "world", "sim", data=b'{"do": "sim", "set": {"wire.noise": 0.03135}}'),
            Event(9.3032, "world", "sim", data=b'{"do": "sim", "set": {"cell.scale": 4.65}}'),
            Event(9.4556, "worker", "take", (52.25,), way="read_and_write"),
            Event(9.6263, "rival", "reset"),
        ],
    ),
    (
        272935,
        [
            Event(1.0002, "load_cell", "lost", (3.0, 0.9672), b"ST,GS,     nankg\r\n"),
            Event(1.0389, "worker", "take", (24.76,)),
        ],
    ),
    (  # three kilograms are told while no force comes, and miss the target the other way
        280962,
        [
            Event(2.9743, "worker", "take", (45.01,)),
            Event(4.4417, "world", "cell-frozen", (1.0,)),
            Event(6.4752, "world", "no-air", (1.0,)),
            Event(10.532, "worker", "reset"),
            Event(12.5522, "world", "cell-frozen", (0.0,)),
            Event(13.5201, "worker", "take", (5.27,)),
            Event(15.24, "worker", "ask", (1,), b"\x06\x00\t\x0b\xb8"),
        ],
    ),
]
