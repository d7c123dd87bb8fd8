"""Places that hold the last of several values: settings of a simulation, the force before a plant, files for people."""

import io
import json
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from gateway.cli.support_bundle import pack_bundle
from gateway.diagnosis.force_error import ErrorBlock
from gateway.plain_file import tell_place_and_refusal
from gateway.plants.force_reference import ForceReference, keep_reference, kept_reference
from gateway.processes.durable_file import replace_text
from gateway.recording.export import export_csv, export_parquet
from gateway.recording.reader import Recording
from gateway.service.simulation.kept_settings import KeptSettings
from gateway.service.simulation.settings import SimulationSettings
from tests.disk.drawn.players.player import Player


class ValuePlayer(Player):
    """possible: numbers of the values that may be there, 0 for none; durable: those that may be behind a power cut.
    has_one_writer: one process alone."""

    has_one_writer: ClassVar = False

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.number = self.under_way = 0
        self.is_alone = True
        self.possible, self.durable = {0}, {0}

    def write(self, number: int) -> None:
        """Have this one there from now on. OSError refuses."""
        raise NotImplementedError

    def read(self) -> int:
        """Return which one is there, 0 for none. Anything but OSError is a mixture."""
        raise NotImplementedError

    def act(self) -> None:
        self.number += 1
        self.under_way += 1
        self.is_alone = self.under_way == 1
        number, before = self.number, self.possible
        self.possible, self.durable = before | {number}, self.durable | {number}
        try:
            self.write(number)
        except OSError as refusal:
            self.scene.note(f"{type(self).__name__} {number}: {refusal}")
            self.judge_words(tell_place_and_refusal(refusal))
            is_undone = not any(
                call.what in ("fsync", "open") for call in self.disk.refused
            )  # of the folder, at its end
            if is_undone and self.is_alone:
                self.possible, self.durable = before, self.durable - {number}
        else:
            self.scene.note(f"{type(self).__name__} {number}: stored")
            if self.is_alone:
                self.possible = self.durable = {number}
        finally:
            self.under_way -= 1

    def verb(self) -> None:
        """Somebody reads it meanwhile, or writes it, too."""
        if not self.has_one_writer and self.rng.random() < 0.4:
            self.act()
            return
        self.disk.refused.clear()
        allowed = set(self.possible)
        try:
            found = self.read()
        except OSError as refusal:
            self.judge_words(tell_place_and_refusal(refusal))
            return
        if not self.disk.refused and self.disk.is_well and not self.is_touched and found not in allowed | self.possible:
            self.complain(f"{found} is read, {allowed | self.possible} may be there")

    def lose_power(self) -> None:
        self.possible = set(self.durable)

    def judge(self) -> None:
        if not self.disk.is_well or self.is_touched:
            return
        found = self.read()
        if found not in self.possible:
            self.complain(f"{found} is there, {self.possible} may be")
        self.possible = {found}

    def judge_healed(self) -> None:
        """It takes another one, whatever was, and leaves nothing else behind."""
        self.act()
        if len(self.possible) != 1:
            self.complain(f"it takes none on a disk that is well: {self.possible} may be there")
        self.is_touched = False
        self.judge()


class SettingsPlayer(ValuePlayer):
    """What is set on a simulated rig: for the time of one gateway, which ends with the power."""

    folders: ClassVar = ("simulation.json",)
    has_one_writer: ClassVar = True

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.run = 0

    def write(self, number: int) -> None:
        KeptSettings(self.state, str(self.run)).write(SimulationSettings({"cell.noise": number / 1000}))

    def read(self) -> int:
        kept = KeptSettings(self.state, str(self.run)).read()
        return round(1000 * kept.number("cell.noise"))

    def lose_power(self) -> None:
        self.run += 1
        self.possible = {0}


class ForceReferencePlayer(ValuePlayer):
    """How large the error of the force was before a plant."""

    folders: ClassVar = ("plants/reference.json",)

    def write(self, number: int) -> None:
        block = ErrorBlock(1.0, 2.0, True, True, number, 3.0)
        keep_reference(self.state, ForceReference(number, f"{number:04d}.fgr", 0, (block,) * 9))

    def read(self) -> int:
        kept = kept_reference(self.state)
        assert kept is None or {block.rows for block in kept.blocks} == {kept.plant}
        return kept.plant if kept else 0


class FilePlayer(ValuePlayer):
    """Files for people, written by verbs and by the page: an export, a report, a bundle of what helps from afar."""

    KINDS: ClassVar = ("csv", "parquet", "text", "tar.gz")

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.kind = self.rng.choice(self.KINDS)
        self.target = scene.outside / f"given.{self.kind}"

    def write(self, number: int) -> None:
        columns = {"time_s": np.arange(40.0), "force_n": np.full(40, float(number))}
        given = Recording(self.target, {"rig": "demo", "number": number}, columns, 40, False)
        parts = {f"part-{part}.txt": f"{number}\n" * 300 for part in range(3)}
        writers: dict[str, Callable[[], None]] = {
            "csv": lambda: export_csv(given, self.target),
            "parquet": lambda: export_parquet(given, self.target),
            "text": lambda: replace_text(self.target, f"{number}\n" * 900),
            "tar.gz": lambda: pack_bundle(parts, self.target),
        }
        writers[self.kind]()

    def read(self) -> int:
        if not self.target.exists():
            return 0
        data = self.target.read_bytes()
        try:
            numbers = self._numbers(data)
        except Exception as error:
            self.complain(f"{self.target.name} of {len(data)} bytes is half: {error!r}")
            return self.number
        if len(numbers) != 1:
            self.complain(f"{self.target.name} is a mixture of {numbers}")
        return int(numbers.pop())

    def _numbers(self, data: bytes) -> set[float]:
        """The numbers of all that it holds, whole."""
        match self.kind:
            case "csv":
                rows = [line.split(",") for line in data.decode().splitlines() if line[0].isdigit()]
                assert [float(row[0]) for row in rows] == list(range(40))
                return {float(row[1]) for row in rows}
            case "parquet":
                from pyarrow import parquet

                table = parquet.read_table(io.BytesIO(data))
                assert table.num_rows == 40
                return set(table["force_n"].to_pylist()) | {float(json.loads(table.schema.metadata[b"number"]))}
            case "text":
                lines = data.decode().splitlines()
                assert len(lines) == 900
                return set(map(float, lines))
        return _numbers_in_archive(data)


def _numbers_in_archive(data: bytes) -> set[float]:
    import tarfile

    with tarfile.open(fileobj=io.BytesIO(data), mode="r:gz") as archive:
        texts = [stream.read().split() for one in archive if (stream := archive.extractfile(one))]
    assert [len(words) for words in texts] == [300] * 3
    return {float(word) for words in texts for word in words}
