"""The rig's reference recording, the counter of births, and who copies or looks at the whole state directory meanwhile."""

import shutil
from hashlib import sha256
from pathlib import Path
from typing import Any, ClassVar

from click.testing import CliRunner

from gateway.audit.audit_reader import verify_audit
from gateway.calibrations.store import CalibrationStore
from gateway.cli.main import command
from gateway.cli.state_archive import pack_state, unpack_state
from gateway.cli.support_bundle import collect_parts, pack_bundle
from gateway.numbered_documents.store import NumberedStore
from gateway.plants.store import PlantStore
from gateway.recording import list_recordings
from gateway.telemetry.mqtt.kept_bd_seq import KeptBdSeq
from gateway.watch.reference_recording import (
    drop_reference_recording,
    keep_reference_recording,
    read_reference_recording,
    reference_path,
)
from tests.disk.drawn.players.audit_player import AuditPlayer
from tests.disk.drawn.players.own_words import SECRET
from tests.disk.drawn.players.player import Player
from tests.disk.drawn.players.store_player import BUILT_IN, StorePlayer


class ReferencePlayer(Player):
    """possible: hashes of what may be the reference, empty for none."""

    folders: ClassVar = ("reference",)

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.possible = {""}
        self.sources = scene.unseen / "sources"
        self.sources.mkdir(exist_ok=True)

    def act(self) -> None:
        before, drops = self.possible, self.rng.random() < 0.2
        source = self.sources / f"{self.rng.randrange(1, 4):04d}.fgr"
        if not drops:
            source.write_bytes(self.rng.randbytes(self.rng.choice([0, 300, 9000])))
        wanted = "" if drops else sha256(source.read_bytes()).hexdigest()
        self.possible = allowed = before | {wanted}
        is_done = False
        try:
            if not drops:
                keep_reference_recording(self.state, source)
            is_done = not drops or drop_reference_recording(self.state)
        except OSError as refusal:
            self.judge_words(str(refusal.strerror))
            self.scene.note(f"reference: {refusal}")
        finally:
            self.possible = {wanted} if is_done and self.possible is allowed else self.possible | {wanted}
        self.scene.note(f"reference {wanted[:6] or 'none'}: {is_done}")

    def judge(self) -> None:
        known = read_reference_recording(self.state)
        if self.is_touched:
            return
        if known is None:
            if "" not in self.possible:
                self.complain("there is no reference any more")
            return
        there = sha256(reference_path(self.state, known).read_bytes()).hexdigest()
        if there != known.sha256:
            self.complain(f"{known.name} is not what was kept: half old, half new")
        if there not in self.possible:
            self.complain(f"the reference {there[:6]} is none that was chosen: {[one[:6] for one in self.possible]}")
        self.possible = {there}

    def judge_healed(self) -> None:
        """Another one is taken."""
        self.judge()
        for _ in range(5):
            self.act()
        if len(self.possible) != 1:
            self.complain(f"it takes none on a disk that is well: {self.possible} may be there")
        self.judge()


class CounterPlayer(Player):
    """told: numbers of births since the disk was last seen to refuse one."""

    folders: ClassVar = ("sparkplug.json",)

    def __init__(self, scene: Any) -> None:
        super().__init__(scene)
        self.last: int | None = None
        self.counter: KeptBdSeq | None = None

    def begin(self) -> None:
        self.disk.refused.clear()
        self.counter = KeptBdSeq(self.state)
        if self.disk.refused:  # nobody knows where it was
            self.last = None

    def act(self) -> None:
        assert self.counter
        self.disk.refused.clear()
        number = self.counter.next()
        self.counter.note_connected()
        if self.last is not None and not 1 <= (number - self.last) % 256 < 128 and not self.is_touched:
            self.complain(f"birth {number} follows {self.last}")
        self.last = number if self.counter._kept == number else None

    def verb(self) -> None: ...

    def die(self) -> None:
        self.counter = None

    def judge(self) -> None: ...

    def judge_healed(self) -> None:
        """It counts on."""
        self.act()
        if self.last is None and not self.is_touched:
            self.complain("a birth is not kept on a disk that is well")


class Onlooker(Player):
    """Copies or packs the whole state directory while others change it."""

    folders: ClassVar = ("lock",)

    def act(self) -> None:
        self.rng.choice([self._back_up, self._back_up, self._bundle])()

    def _back_up(self) -> None:
        archive, copy = self.scene.unseen / "kept.tar.gz", self.scene.unseen / "copy"
        stored = {type(one): set(one.documents) for one in self.scene.players if isinstance(one, StorePlayer)}
        synced = {one for each in self.scene.players if isinstance(each, AuditPlayer) for one in each.synced}
        try:
            pack_state(self.state, archive)
        except OSError as refusal:
            self.judge_words(str(refusal.strerror))
            return
        with self.disk.aside():
            unpack_state(archive, copy)
            self._judge_copy(copy, stored, bool(synced))
            shutil.rmtree(copy)

    def _judge_copy(self, copy: Path, stored: dict[type, set[int]], has_audit: bool) -> None:
        if any(one.is_touched for one in self.scene.players):
            return
        stores: list[NumberedStore[Any]] = [CalibrationStore(copy, BUILT_IN), PlantStore(copy)]
        for store, player in zip(stores, self._store_players(), strict=True):
            if player and (notes := store.find_selected().notes):
                self.complain(f"a backup's {store.noun}: {notes}")
            if player and (missing := stored[type(player)] - set(store.numbers())):
                self.complain(f"a backup lacks {store.noun} {missing}")
        if has_audit and (broken := verify_audit(copy).broken):
            self.complain(f"a backup's audit: {broken}")
        if faults := [entry.fault for entry in list_recordings(copy) if entry.fault and entry.rows]:
            self.complain(f"a backup's recordings: {faults}")

    def _store_players(self) -> list[StorePlayer | None]:
        found = {one.folders[0]: one for one in self.scene.players if isinstance(one, StorePlayer)}
        return [found.get("calibrations"), found.get("plants")]

    def _bundle(self) -> None:
        parts = collect_parts(self.state, lambda: [("rig.yaml", f"name: demo\nweb:\n  token: {SECRET}\n")])
        if told := [name for name, text in parts.items() if SECRET in text]:
            self.complain(f"a secret is in {told} of a bundle")
        for text in parts.values():
            if "[Errno" in text or "Traceback" in text:
                self.complain(f"a bundle's part without a sentence: {text[:200]}")
        pack_bundle(parts, self.scene.unseen / "report.tar.gz")

    def judge(self) -> None: ...


class Terminal(Player):
    """Whoever types verbs meanwhile."""

    folders: ClassVar = ("lock",)
    VERBS: ClassVar = (
        "recordings list", "recordings show 1", "recordings keep 1", "recordings delete 1 --yes", "calibration list",
        "calibration show", "calibration use 1001", "calibration rollback", "plant list", "plant show 1", "audit verify",
        "audit list", "events", "recordings prune --days 30 --yes", "recordings reference 1",
    )  # fmt: skip

    def act(self) -> None:
        verb = self.rng.choice(self.VERBS)
        result = CliRunner().invoke(command, [*verb.split(), "--state", str(self.state), "--rig", "demo"])
        self.scene.note(f"{verb}: {result.exit_code} {result.output[:300]!r}")
        said = result.output
        if result.exception and not isinstance(result.exception, SystemExit):
            self.complain(f"{verb} raises {result.exception!r}")
        if any(words in said for words in ("[Errno", "Traceback", "internal error")):
            self.complain(f"{verb}: {said[:300]}")
        if result.exit_code and not said.strip():
            self.complain(f"{verb} ends with {result.exit_code} and says nothing")
        for one in self.scene.players:
            if isinstance(one, StorePlayer) and verb.split()[-1] in ("1001", "rollback"):
                one.is_touched = True
            if verb.startswith("recordings") and "recordings" in one.folders:
                one.is_touched = True

    def judge(self) -> None: ...
