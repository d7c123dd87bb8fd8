"""The heartbeat that a verb begins with. What was refused a moment ago counts again with another one only (W302): one that
followed from what stands in the register would be the same, for a refused write has left that as it was."""

from random import randrange


def draw_first_heartbeat(standing: int) -> int:
    """Return a heartbeat to begin with, another one than stands in the register."""
    return (standing + randrange(1, 0x10000)) % 0x10000
