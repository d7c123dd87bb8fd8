"""Words that a shell offers for an argument: rigs, registers, effects, codes, recordings, calibrations, plants; and files.

Each function is a click `shell_complete` callback. Whatever goes wrong while a shell asks must not be seen there: then there is
nothing to offer. What they need is imported when they are asked.
"""

from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import Any, Final, TypeAlias

import click
from click.shell_completion import CompletionItem

from gateway.processes.state_directory import CALIBRATIONS, PLANTS, RECORDINGS

# Texts, for before click 8.5 an item takes no type.
Items: TypeAlias = "list[CompletionItem[str]]"
Words: TypeAlias = "Callable[[click.Context, str], Iterable[CompletionItem[str]]]"
_MOST: Final = 200


def _completes(*, files: bool = False) -> Callable[[Words], Any]:
    """Turn a function that names words into a click callback: those that begin as typed, files besides."""

    def decorate(words: Words) -> Any:
        @wraps(words)
        def complete(context: click.Context, parameter: click.Parameter, incomplete: str) -> Items:
            try:
                found = [item for item in words(context, incomplete) if item.value.startswith(incomplete)][:_MOST]
            except Exception:  # a shell that asks has no place for a message
                found = []
            return [*found, CompletionItem(incomplete, type="file")] if files else found

        return complete

    return decorate


def _items(names: Iterable[str]) -> Items:
    return [CompletionItem(name) for name in names]


@_completes(files=True)
def complete_rigs(context: click.Context, incomplete: str) -> Items:
    """Offer shipped rigs, those that have run here, and files."""
    from gateway.cli.command_line.known_rigs import known_rigs

    return _items(known_rigs())


@_completes(files=True)
def complete_profiles(context: click.Context, incomplete: str) -> Items:
    """Offer shipped rigs and files of any kind of profile, for `check`."""
    from gateway.profiles import list_shipped

    return _items(name for kind in ("rig", "device", "plant") for name in list_shipped(kind))


@_completes(files=True)
def complete_calibration_files(context: click.Context, incomplete: str) -> Items:
    """Offer shipped calibrations and files."""
    from gateway.profiles import list_shipped

    return _items(list_shipped("calibration"))


@_completes(files=True)
def complete_plant_files(context: click.Context, incomplete: str) -> Items:
    """Offer shipped plants and files."""
    from gateway.profiles import list_shipped

    return _items(list_shipped("plant"))


@_completes(files=True)
def complete_maps(context: click.Context, incomplete: str) -> Items:
    """Offer shipped register maps and files."""
    from gateway.profiles import list_shipped

    return _items(list_shipped("registers"))


@_completes()
def complete_registers(context: click.Context, incomplete: str) -> Items:
    """Offer registers, and blocks as `read` takes them."""
    from gateway.registers.map.register_map import PLAIN_BLOCKS

    register_map = _register_map(context)
    plain = [register for register in register_map.registers if register.block in PLAIN_BLOCKS]
    others = [f"{one.name}@{one.block}" for one in register_map.registers if one.block not in PLAIN_BLOCKS]
    named = [CompletionItem(register.name, help=register.text) for register in plain]
    return [*named, *_items(block.name for block in register_map.blocks), *_items(others if "@" in incomplete else ())]


@_completes()
def complete_assignments(context: click.Context, incomplete: str) -> Items:
    """Offer NAME= of registers that can be written, then the names of its values or bits."""
    register_map = _register_map(context)
    name, equals, _ = incomplete.partition("=")
    if equals:
        register = register_map.find(name)
        return _items(f"{name}={value}" for value in (*register.values.values(), *register.bits.values()))
    writable = [one for one in register_map.registers_of("command") if one.is_writable]
    return [CompletionItem(f"{register.name}=", help=register.text) for register in writable]


@_completes()
def complete_effects(context: click.Context, incomplete: str) -> Items:
    """Offer the effects of the catalogue."""
    from gateway.catalogue.all_effects import EFFECTS

    return [CompletionItem(effect.name, help=effect.what) for effect in EFFECTS]


@_completes()
def complete_settings(context: click.Context, incomplete: str) -> Items:
    """Offer NAME= of what can be set on a simulated rig."""
    return [CompletionItem(f"{name}=", help=what) for name, what in _setting_names()]


@_completes()
def complete_setting_names(context: click.Context, incomplete: str) -> Items:
    """Offer names of what can be cleared on a simulated rig."""
    return [CompletionItem(name, help=what) for name, what in _setting_names()]


@_completes()
def complete_codes(context: click.Context, incomplete: str) -> Items:
    """Offer every code, and the names that registers have for them."""
    from gateway.codes.all_codes import CATALOGUE

    codes = [CompletionItem(entry.code, help=entry.title) for entry in CATALOGUE.values()]
    return [*codes, *(CompletionItem(entry.name, help=entry.title) for entry in CATALOGUE.values() if entry.name)]


@_completes(files=True)
def complete_recordings(context: click.Context, incomplete: str) -> Items:
    """Offer the numbers of recordings in the state directory that is meant, the last one, and files."""
    numbers = _numbers_in(_directory(context) / RECORDINGS, "*.fgr")
    return _items([*numbers, "last"] if numbers else [])


@_completes()
def complete_recording_numbers(context: click.Context, incomplete: str) -> Items:
    """Offer the numbers of recordings in the state directory that is meant."""
    return _items(_numbers_in(_directory(context) / RECORDINGS, "*.fgr"))


@_completes(files=True)
def complete_calibrations(context: click.Context, incomplete: str) -> Items:
    """Offer the numbers of calibrations, shipped names, and files."""
    from gateway.profiles import list_shipped

    return _items([*_stored(context, CALIBRATIONS), *list_shipped("calibration")])


@_completes()
def complete_calibration_numbers(context: click.Context, incomplete: str) -> Items:
    """Offer the numbers of calibrations in the state directory that is meant."""
    return _items(_stored(context, CALIBRATIONS))


@_completes()
def complete_plant_numbers(context: click.Context, incomplete: str) -> Items:
    """Offer the numbers of plants in the state directory that is meant, 0 for the rig's own."""
    return _items(["0", *_stored(context, PLANTS)])


def _register_map(context: click.Context) -> Any:
    from gateway import defaults
    from gateway.profiles import load_register_map

    return load_register_map(context.params.get("map_name") or defaults.REGISTER_MAP)


def _setting_names() -> list[tuple[str, str]]:
    from gateway.catalogue.all_effects import EFFECTS
    from gateway.service.simulation.setting_names import FAULTS, SURROUNDINGS

    named = [(one.name, one.what) for one in (*FAULTS, *SURROUNDINGS)]
    return [*named, *((effect.name, effect.what) for effect in EFFECTS)]


def _directory(context: click.Context) -> Path:
    from gateway.cli.command_line.known_rigs import directory_of

    given = context.params
    return directory_of(Path(given["state"]) if given.get("state") else None, given.get("rig"))


def _stored(context: click.Context, folder: str) -> list[str]:
    return _numbers_in(_directory(context) / folder, "*.yaml")


def _numbers_in(folder: Path, pattern: str) -> list[str]:
    """Return the numbers of files such as 0017.fgr, the newest first."""
    numbers = {int(path.stem) for path in folder.glob(pattern) if path.stem.isdecimal()}
    return [str(number) for number in sorted(numbers, reverse=True)]
