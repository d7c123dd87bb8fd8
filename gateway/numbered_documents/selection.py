"""Which document of a store is in use, as a file of its own: generation files of which the highest whole one counts.

A change writes the next generation (gateway.processes.durable_file), so the active set is the old one or the new one
and never a
mixture: number, slot and all eight slots change together. The whole generation before is kept for the case that the
newest is damaged; others are removed.

Calibrations fill slots besides, which a master selects; plants fill none. A slot may hold the rig's built-in calibration:
not its number, which another rig file may give to another set, but OWN, which means what the rig's file names, as "none
chosen" does.
"""

import json
import re
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

from gateway.processes.durable_file import (
    add_checksum,
    read_regular,
    remove_if_possible,
    verify_checksum,
    write_durably,
)
from gateway.registers.upload.staging import SLOTS
from gateway.registers.upload.staging_block import NO_SLOT

OWN: Final = 0  # in a slot; numbers of the store begin at 1
_NAME: Final = re.compile(r"active\.(\d{6,})")


@dataclass(frozen=True, slots=True)
class Selection:
    """number: of a document in the store, None for the rig's built-in one; slot: where it was taken from, if from one."""

    number: int | None = None
    slot: int | None = None

    @property
    def slot_word(self) -> int:
        """Value of the active_slot register."""
        return NO_SLOT if self.slot is None else self.slot


BUILT_IN: Final = Selection()


@dataclass(frozen=True, slots=True)
class SelectionState:
    """active: what is in use; previous: what a rollback brings back; slots: number of the document in each, OWN for the
    rig's built-in one, None where it is empty."""

    generation: int = 0
    active: Selection = BUILT_IN
    previous: Selection = BUILT_IN
    slots: tuple[int | None, ...] = (None,) * SLOTS

    @property
    def numbers(self) -> tuple[int, ...]:
        """Documents of the store that this speaks of."""
        named = (self.active.number, self.previous.number, *self.slots)
        return tuple(number for number in named if number)

    def in_slot(self, slot: int) -> Selection | None:
        """Return what selecting a slot (0 .. 7) means; None when it is empty."""
        number = self.slots[slot]
        return None if number is None else Selection(number or None, slot)

    def with_active(self, selection: Selection, previous: Selection) -> "SelectionState":
        """Return what holds after a change; a selection with a slot fills that slot."""
        slots = list(self.slots)
        if selection.slot is not None:
            slots[selection.slot] = selection.number or OWN
        return replace(self, active=selection, previous=previous, slots=tuple(slots))


def read_selection(directory: Path, noun: str, *, is_to_change: bool = False) -> tuple[SelectionState, tuple[str, ...]]:
    """Return the newest whole generation, and a sentence for each newer one that is not. Nothing stored is generation 0.
    noun: what the documents are, for the sentences. is_to_change: a generation that the disk does not give is an OSError, for
    it may be whole, and what followed the one before it would undo it."""
    damaged: list[str] = []
    for generation, name in reversed(_generations(directory)):
        try:
            pointer = _parse_state(read_regular(directory / name), generation)
        except OSError as error:
            if is_to_change:
                raise
            damaged.append(f"{directory / name} cannot be read: {error.strerror}")
            continue
        except ValueError as error:
            damaged.append(f"{directory / name} {error}")
            continue
        consequence = f"the generation before it is used ({generation})"
        return pointer, tuple(f"E432 {sentence}; {consequence}" for sentence in damaged)
    consequence = f"no whole one is left, the rig's built-in {noun} is used"
    return SelectionState(), tuple(f"E432 {sentence}; {consequence}" for sentence in damaged)


def write_selection(directory: Path, descriptor: int, pointer: SelectionState) -> SelectionState:
    """Return the pointer as the next generation, durable when this returns; OSError, and nothing has changed, when not.

    pointer.generation is that of the one which it follows.
    """
    before = _generations(directory)
    fresh = replace(pointer, generation=1 + max((number for number, _ in before), default=0))
    write_durably(descriptor, f"active.{fresh.generation:06d}", add_checksum(json.dumps(asdict(fresh)) + "\n"))
    for number, name in before:
        if number != pointer.generation:
            remove_if_possible(descriptor, name)
    return fresh


def _generations(directory: Path) -> list[tuple[int, str]]:
    """Oldest first."""
    try:
        names = [path.name for path in directory.iterdir()]
    except FileNotFoundError:
        return []
    return sorted((int(match[1]), name) for name in names if (match := _NAME.fullmatch(name)))


def _parse_state(data: bytes, generation: int) -> SelectionState:
    """ValueError for anything that this module has not written."""
    try:
        facts = json.loads(verify_checksum(data))
        pointer = SelectionState(
            facts["generation"], _selection(facts["active"]), _selection(facts["previous"]), tuple(facts["slots"])
        )
    except (KeyError, TypeError) as error:
        raise ValueError(f"is no selection: {error}") from None
    if pointer.generation != generation or len(pointer.slots) != SLOTS:
        raise ValueError(f"holds generation {pointer.generation}, its name says {generation}")
    return pointer


def _selection(facts: dict[str, Any]) -> Selection:
    return Selection(facts["number"], facts["slot"])
