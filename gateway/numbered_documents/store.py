"""A store of numbered, immutable documents of one rig, and which of them is in use.

STATE/NAME holds NNNN.yaml (NNNNN.yaml from 10000 on), each with its CRC-32 in the first line, and the generations of the
selection (gateway.numbered_documents.selection). Number and content belong together for good; a number that the rig's built-in
document has is not given again. Whatever is damaged is named and passed over: the document in use, else the one before it,
else the built-in one. There is no clock here: dates come with the documents.

The methods wait for the disk. Processes and threads may call them at the same time.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Generic, TypeVar

from gateway.numbered_documents.selection import BUILT_IN, Selection, SelectionState, read_selection, write_selection
from gateway.plain_file import is_directory, tell_place_and_refusal
from gateway.processes.durable_file import lock_directory, make_directory, read_regular, write_durably
from gateway.registers.upload.staging import SLOTS

Document = TypeVar("Document")

_NAME: Final = re.compile(r"(\d{4}|[1-9]\d{4})\.yaml")
_LAST: Final = 0xFFFF  # what the registers can show


class StoreError(Exception):
    """A document cannot be stored, read or used; what was in use stays. str: the sentence, which begins with its code.
    is_unread: the disk did not give it, and it may be whole."""

    def __init__(self, code: str, sentence: str, *, is_unread: bool = False) -> None:
        super().__init__(f"{code} {sentence}")
        self.code = code
        self.is_unread = is_unread


@dataclass(frozen=True, slots=True)
class StoredDocument(Generic[Document]):
    """One file of the store; document None and a sentence in fault when it is damaged."""

    number: int
    document: Document | None
    fault: str = ""


@dataclass(frozen=True, slots=True)
class SelectedDocument(Generic[Document]):
    """What is in use. document None: the built-in one, where the store was not told it. notes: what was passed over."""

    document: Document | None
    selection: Selection
    pointer: SelectionState
    notes: tuple[str, ...] = ()


Numbers = list[int]


class NumberedStore(ABC, Generic[Document]):
    """noun: what its documents are; built_in: the one that the rig's file names, None where it is no document of this
    kind or not known."""

    noun: str

    def __init__(self, directory: Path, built_in: Document | None = None) -> None:
        self.directory = directory
        self.built_in = built_in

    # -- what its documents are

    @abstractmethod
    def number_of(self, document: Document) -> int:
        """Return the number that a document carries."""

    @abstractmethod
    def encode(self, document: Document, number: int) -> bytes:
        """Return its file under this number. StoreError for one that could not be read back as it is."""

    @abstractmethod
    def decode(self, data: bytes, path: Path) -> Document:
        """Return the document of a file's bytes. StoreError for anything but what `encode` has made."""

    # -- documents

    def add(self, document: Document) -> int:
        """Store it under the next number, whatever number it has; return that number. StoreError, and nothing has changed, for
        one that could not be read back or when the disk refuses."""
        try:
            make_directory(self.directory)
            with lock_directory(self.directory) as descriptor:
                number = self._next_number()
                write_durably(descriptor, file_name(number), self.encode(document, number))
        except OSError as error:
            raise self._disk_error(error) from error
        return number

    def list(self) -> list[StoredDocument[Document]]:
        """Return every document of the store by number, damaged ones with their fault."""
        return [self._entry(number) for number in self.numbers()]

    def load(self, number: int) -> Document:
        """Return a document by its number, that of the built-in one included. StoreError when it is not there or damaged."""
        path = self.directory / file_name(number)
        try:
            document = self.decode(read_regular(path), path)
        except FileNotFoundError:
            return self._built_in(number)
        except OSError as error:
            raise StoreError("E432", f"{path} cannot be read: {error.strerror}", is_unread=True) from None
        if self.number_of(document) != number:
            raise StoreError("E432", f"{path} says that it is {self.noun} {self.number_of(document)}")
        return document

    def find_selected(
        self, why_unusable: Callable[[Document], str] = lambda document: ""
    ) -> SelectedDocument[Document]:
        """Return the document in use: the active one, else the previous, else the built-in.

        why_unusable: a sentence for one that is not fit for this rig, empty for one that is.
        """
        pointer, notes = self._pointer()
        for selection in (pointer.active, pointer.previous):
            if selection.number is None:
                return SelectedDocument(self.built_in, selection, pointer, notes)
            try:
                document = self.load(selection.number)
                fault = why_unusable(document)
            except StoreError as error:
                fault = str(error)
            if not fault:
                return SelectedDocument(document, selection, pointer, notes)
            notes = (*notes, f"{fault}; the one before it is used instead of {self.noun} {selection.number}")
        return SelectedDocument(self.built_in, BUILT_IN, pointer, notes)

    def use(self, number: int | None, slot: int | None = None, *, last_one_waits: bool = False) -> SelectionState:
        """Put this document in use, None: the built-in one; a slot given is filled with it. last_one_waits: the one before was
        never in use, and is nothing to go back to. StoreError, and nothing has changed, for one that cannot be loaded or when
        the disk refuses."""
        if number is not None and self.load(number) is self.built_in:
            number = None
        if slot is not None and not 0 <= slot < SLOTS:
            raise StoreError("E433", f"slot {slot}: there are 0 .. {SLOTS - 1}")
        return self._change(Selection(number, slot), last_one_waits=last_one_waits)

    def previous(self) -> Selection:
        """Return what a rollback brings back. StoreError where nothing was ever changed, or it cannot be known now."""
        pointer, _ = self._pointer(is_to_change=True)
        if pointer.generation == 0:
            raise StoreError("E433", f"no {self.noun} was in use before this one: there is nothing to go back to")
        previous = pointer.previous
        is_in_slot = previous.slot is not None and pointer.in_slot(previous.slot) == previous
        return previous if is_in_slot else Selection(previous.number)

    def _change(self, selection: Selection, *, last_one_waits: bool) -> SelectionState:
        try:
            make_directory(self.directory)
            with lock_directory(self.directory) as descriptor:
                pointer, _ = read_selection(self.directory, self.noun, is_to_change=True)
                previous = pointer.previous if last_one_waits else self._to_go_back_to(pointer, selection)
                changed = pointer.with_active(selection, previous)
                return write_selection(self.directory, descriptor, changed)
        except OSError as error:
            raise self._disk_error(error) from error

    def _to_go_back_to(self, pointer: SelectionState, selection: Selection) -> Selection:
        """Return what is in use now, unless it is damaged or is chosen again: then what could be gone back to stays."""
        active = pointer.active
        if active.number == selection.number or (active.number is not None and self._is_damaged(active.number)):
            return pointer.previous
        return active

    def _is_damaged(self, number: int) -> bool:
        try:
            self.load(number)
        except StoreError as error:
            return not error.is_unread
        return False

    def _pointer(self, *, is_to_change: bool = False) -> tuple[SelectionState, tuple[str, ...]]:
        try:
            with lock_directory(self.directory, shared=True):
                return read_selection(self.directory, self.noun, is_to_change=is_to_change)
        except FileNotFoundError:
            return SelectionState(), ()
        except OSError as error:
            if is_to_change:
                raise self._unread_error(error) from None
            return SelectionState(), (
                f"E432 {self.directory} cannot be read: {error.strerror}; built-in {self.noun} used",
            )

    def _entry(self, number: int) -> StoredDocument[Document]:
        try:
            return StoredDocument(number, self.load(number))
        except StoreError as error:
            return StoredDocument(number, None, str(error))

    def _built_in(self, number: int) -> Document:
        if self.built_in is not None and self.number_of(self.built_in) == number:
            return self.built_in
        own = [] if self.built_in is None else [self.number_of(self.built_in)]
        try:
            known = ", ".join(map(str, sorted({*own, *self.numbers()}))) or "none yet"
        except OSError as error:
            raise self._unread_error(error) from None
        raise StoreError("E433", f"there is no {self.noun} {number} in {self.directory}; there are: {known}")

    def numbers(self) -> Numbers:
        """Return the numbers that the store has, in order."""
        names = [path.name for path in self.directory.iterdir()] if is_directory(self.directory) else []
        return sorted(int(match[1]) for name in names if (match := _NAME.fullmatch(name)))

    def _next_number(self) -> int:
        selected, _ = read_selection(self.directory, self.noun, is_to_change=True)
        number = 1 + max(0, *self.numbers(), *selected.numbers, self.number_of(self.built_in) if self.built_in else 0)
        if number > _LAST:
            raise StoreError(
                "E431", f"{self.directory} holds {self.noun} {_LAST}, the last number: start a new --state"
            )
        return number

    def _unread_error(self, error: OSError) -> StoreError:
        place = error.filename or self.directory
        return StoreError("E432", f"{place} cannot be read: {error.strerror}", is_unread=True)

    def _disk_error(self, error: OSError) -> StoreError:
        return StoreError("E431", f"{self.noun} not stored: {tell_place_and_refusal(error)}")


def file_name(number: int) -> str:
    """Return the name of a document's file."""
    return f"{number:04d}.yaml"
