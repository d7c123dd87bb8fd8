"""Reading the active set back and committing it changes nothing; what it cannot carry, it says."""

import struct
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from gateway.bsfm import Calibration, CoefficientLimits, Coefficients, Response, validate_coefficients
from gateway.calibrations.activation import make_uploaded
from gateway.profiles import load_calibration
from gateway.registers import RegisterMap
from gateway.registers.upload.coefficients import CoefficientSet, model_hash, words_of_block
from gateway.registers.upload.staging import Staged, check_staged
from gateway.registers.words import CommitNotice, CommitStatus
from tests.calibrations.coefficients import calibration, staged
from tests.calibrations.upload_bench import COMMIT, PEER, Bench
from tests.gate.budgets import examples

COMMITTED = (CommitStatus.COMMITTED, 0, 0)
DEMO = load_calibration("demo")
RESPONSE = Response(dead_time_s=0.0803, lag_s=0.0721, second_lag_s=0.031, damping=0.62, source="from 12 steps")


def stops(count: int) -> dict[str, tuple[float, ...]]:
    shares = [1.0 / count] * (count - 1)
    return {"slip_radii_v": tuple(0.31 * (k + 1) for k in range(count)), "slip_shares": (*shares, 1.0 - sum(shares))}


GIVEN = {
    "shipped": DEMO,
    "blend": calibration(8),
    "own limits": replace(DEMO, force_limits_n=(2.5, 25.3)),
    "limits beyond the branches": replace(DEMO, force_limits_n=(0.0, 90.0)),
    "order 15": calibration(8, order=15),
    "ten stops": calibration(8, order=3, **stops(10)),
    "response": replace(DEMO, response=RESPONSE),
}


def read_back(bench: Bench, register_map: RegisterMap, slot: int = 0) -> None:
    """Every register of the staging block that the active block has under the same name, word by word."""
    names = {register.name for register in register_map.registers_of("active")}
    for register in register_map.registers_of("staging"):
        if register.is_writable and register.name in names:
            source = register_map.find(f"{register.name}@active").address
            words = struct.unpack(f">{register.words}H", bench.bank.read_registers(source, register.words))
            bench.write(register.address, *words)
    bench.write(1144, slot)


def made(name: str, where: str, state: Path, register_map: RegisterMap) -> Bench:
    """A gateway whose calibration in use is this one: the rig's own, or one of the store, with or without a slot."""
    if where == "the rig's own":
        return Bench(state, register_map, GIVEN[name])
    store = Bench(state, register_map).store
    store.use(store.add(calibration(3)))
    store.use(store.add(GIVEN[name]), 3 if where == "in a slot" else None)
    return Bench(state, register_map)


@pytest.mark.sampled
@pytest.mark.parametrize("where", ["the rig's own", "of the store", "in a slot"])
@pytest.mark.parametrize("name", GIVEN)
def test_committing_the_read_back_of_the_active_set_changes_nothing(name, where, tmp_path, register_map):
    bench = made(name, where, tmp_path, register_map)
    before, block, hashed = bench.upload.status(), bench.active_block, bench.model_hash
    files = sorted(path.name for path in bench.store.directory.glob("*.yaml"))
    read_back(bench, register_map, slot=3)
    assert hashed == int.from_bytes(bench.bank.read_registers(1142, 2), "big"), "the active crc32 is that of the words"
    bench.write(1145, COMMIT)
    bench.run()
    assert bench.outcome == COMMITTED
    assert bench.notice is CommitNotice.KNOWN_SET
    after = bench.upload.status()
    assert [after[key] for key in ("active", "name", "built_in")] == [
        before[key] for key in ("active", "name", "built_in")
    ]
    for there in (bench, bench.restarted()):
        assert (there.model_hash, words_of_block(there.active_block)) == (hashed, words_of_block(block))
        assert there.active_slot == 3
    assert replace(bench.used[-1].calibration, number=GIVEN[name].number) == GIVEN[name]
    assert sorted(path.name for path in bench.store.directory.glob("*.yaml")) == files
    assert "; known here, it keeps number and name" in bench.log[-1]


@pytest.mark.parametrize("name", GIVEN)
def test_a_set_sent_by_a_master_is_the_same_model_but_for_float32(name, tmp_path, register_map):
    """Into a gateway that has never seen it."""
    bench, given = Bench(tmp_path, register_map), GIVEN[name]
    assert bench.upload_of(given, 2) == COMMITTED
    found = bench.used[-1].calibration
    assert bench.notice == (CommitNotice.KNOWN_SET if name == "blend" else 0)
    assert (bench.model_hash, len(found.slip_radii_v)) == (model_hash(given), len(given.slip_radii_v))
    memory, last_n = given.model().reversal.start(), 5.0
    stored_memory = found.model().reversal.start()
    for force_n in (20.0, 12.0, 18.0, 6.0, 24.0):
        memory = given.model().memory_after(memory, last_n, force_n)
        stored_memory = found.model().memory_after(stored_memory, last_n, force_n)
        wanted_v = given.model().voltage_v(force_n, given.model().branch_share(memory))[0]
        assert found.model().voltage_v(force_n, found.model().branch_share(stored_memory))[0] == pytest.approx(
            wanted_v, abs=1e-5
        )
        last_n = force_n
    if given.response:
        assert found.response == replace(given.response, source=f"upload over Modbus by {PEER.host}"), (
            "the decimals that were meant"
        )
        assert bench.store.load(2).response == found.response


def test_a_set_anywhere_in_the_store_is_known_and_a_damaged_one_is_not(tmp_path, register_map):
    bench = Bench(tmp_path, register_map)
    named = {
        name: replace(each, name=name)
        for name, each in GIVEN.items()
        if name not in ("blend", "limits beyond the branches")
    }
    numbers = {name: bench.store.add(each) for name, each in named.items()}
    for name, number in numbers.items():
        assert bench.upload_of(GIVEN[name], 1) == COMMITTED
        status = bench.upload.status()
        assert (status["active"], status["name"], bench.notice) == (number, name, CommitNotice.KNOWN_SET)
    path = bench.store.directory / f"{numbers['shipped']:04d}.yaml"
    path.write_text(path.read_text().replace('name: "shipped"', 'name: "another"'))
    assert bench.upload_of(DEMO, 1) == COMMITTED
    assert (bench.upload.status()["name"], bench.notice) == ("slot-1", 0)


def test_a_search_through_the_store_reads_few_files_whole(tmp_path, register_map, monkeypatch):
    """Reading one whole takes milliseconds of processor, during which the loop waits for its turn."""
    bench = Bench(tmp_path, register_map)
    for mark in range(20, 40):
        bench.store.add(calibration(mark))
    (bench.store.directory / "0007.yaml").write_bytes(b"# crc32 0\nnumber: [\n")
    loaded: list[int] = []
    load = bench.store.load
    monkeypatch.setattr(bench.store, "load", lambda number: loaded.append(number) or load(number))
    assert bench.upload_of(calibration(27), 1) == COMMITTED
    assert (bench.upload.status()["name"], bench.notice) == ("mark 27", CommitNotice.KNOWN_SET)
    assert set(loaded) == {9}
    assert bench.upload_of(calibration(50), 1) == COMMITTED
    assert set(loaded) == {9, 22}, "what is in use, and the new one"


def test_a_set_that_was_in_use_before_or_that_the_rig_names_is_known_too(tmp_path, register_map):
    bench = Bench(tmp_path, register_map, DEMO)
    assert bench.upload_of(calibration(5), 0) == COMMITTED
    assert (bench.upload.status()["active"], bench.notice) == (2, 0)
    assert bench.upload_of(DEMO, 1) == COMMITTED
    status = bench.upload.status()
    assert (status["active"], status["name"], status["slot"], bench.notice) == (1, "demo", 1, CommitNotice.KNOWN_SET)
    bench.write(1149, 0)
    bench.run()
    assert (bench.upload.status()["active"], bench.notice) == (2, 0), "the notice was the last commit's"
    assert bench.upload_of(replace(DEMO, name="another name"), 1) == COMMITTED
    assert bench.upload.status()["name"] == "demo", "a name is not carried"


@st.composite
def calibrations(draw: st.DrawFn) -> Calibration:
    """Any order, reversal, limits and response, in doubles that no float32 carries."""
    third = draw(st.floats(0.9, 1.1))
    order, count = draw(st.sampled_from((1, 2, 3, 5, 15))), draw(st.integers(0, 10))
    given = calibration(draw(st.integers(0, 400)), order=order, blend_span_n=9.0 * third)
    weights = [1.0, *draw(st.lists(st.floats(0.7, 1.4), min_size=order, max_size=order))]
    given = replace(given, rising_weights=tuple(weights), falling_weights=tuple(weights))
    if count:
        parts = draw(st.lists(st.floats(0.05, 1.0), min_size=count, max_size=count))
        radii = tuple(third * (0.9 + k / 3.0) for k in range(count))
        given = replace(given, slip_radii_v=radii, slip_shares=tuple(part / sum(parts) for part in parts))
    if draw(st.booleans()):
        given = replace(given, force_limits_n=(third, 30.0 * third))
    if draw(st.booleans()):
        late_s, lag_s, second_s = draw(st.tuples(st.floats(0.0, 1.0), st.floats(0.001, 2.0), st.floats(0.0, 2.0)))
        damping = draw(st.sampled_from([0.0, 0.0, 0.35, 0.6]))
        response = Response(dead_time_s=late_s, lag_s=lag_s, second_lag_s=second_s, damping=damping)
        given = replace(given, response=response)
    return given


@settings(derandomize=True, deadline=None, max_examples=examples(30))
@given(calibrations())
def test_whatever_a_calibration_is_its_words_make_the_same_words_again(given_set):
    limits = CoefficientLimits(cell_range_n=150.0)
    assume(not validate_coefficients(Coefficients.of_calibration(given_set), limits))
    found = check_staged(staged(CoefficientSet.of_calibration(given_set), slot=1), limits)
    assert isinstance(found, Staged), found
    again = make_uploaded(found, name="x", rig="", date_utc="", source="")
    assert CoefficientSet.of_calibration(again).to_words() == CoefficientSet.of_calibration(given_set).to_words()
    assert model_hash(again) == model_hash(given_set)
    again.model()


CHANGES = {
    "a handle": {
        "rising_handles_n": (DEMO.rising_handles_n[0], DEMO.rising_handles_n[1] + 1e-4, DEMO.rising_handles_n[2])
    },
    "a weight": {"falling_weights": (1.0, DEMO.falling_weights[1] + 1e-5, DEMO.falling_weights[2])},
    "the range": {"x1_v": 7.9},
    "a limit": {"force_limits_n": (2.5, 25.3)},
    "the blend span": {"blend_span_n": 13.5},
    "a radius": {"slip_radii_v": (0.144, *DEMO.slip_radii_v[1:])},
    "a share": {"slip_shares": (DEMO.slip_shares[0] - 1e-5, *DEMO.slip_shares[1:-1], DEMO.slip_shares[-1] + 1e-5)},
    "no stops": {"slip_radii_v": (), "slip_shares": ()},
    "a response": {"response": RESPONSE},
}


def test_the_model_hash_covers_all_that_changes_a_voltage():
    changed = {model_hash(replace(DEMO, **change)) for change in ({}, *CHANGES.values())}
    slower = replace(RESPONSE, second_lag_s=0.032)
    changed |= {
        model_hash(replace(DEMO, response=slower)),
        model_hash(replace(DEMO, response=replace(slower, dead_time_s=0.0))),
        model_hash(replace(DEMO, response=replace(slower, damping=0.0))),
    }
    assert len(changed) == len(CHANGES) + 4
    many = replace(DEMO, slip_radii_v=tuple(0.1 * k for k in range(1, 13)), slip_shares=(0.04,) * 10 + (0.2, 0.4))
    of_the_last = {
        "shares": {"slip_shares": (0.04,) * 10 + (0.4, 0.2)},
        "radii": {"slip_radii_v": (*many.slip_radii_v[:-1], 1.5)},
    }
    assert len({model_hash(replace(many, **change)) for change in ({}, *of_the_last.values())}) == 3, (
        "beyond the registers, too"
    )
    assert model_hash(replace(DEMO, name="x", number=7, source="y", rms_n=1.0)) == model_hash(DEMO)
