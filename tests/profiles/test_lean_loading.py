"""`check` answers at once: nothing heavy is imported, and a rig loads in less than a blink."""

import subprocess
import sys
from time import process_time

from gateway.profiles import check_report
from gateway.profiles.strict_yaml.typed import adapter

HEAVY = ("scipy", "pandas", "matplotlib", "jinja2", "pyarrow", "numba", "pymodbus", "serial", "asyncio", "cryptography")


def test_loading_a_rig_imports_nothing_heavy() -> None:
    source = f"import sys, gateway.profiles as p; p.load_rig('demo'); print([m for m in {HEAVY!r} if m in sys.modules])"
    answer = subprocess.run([sys.executable, "-c", source], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"


def test_the_demo_rig_loads_within_150_ms_validators_included() -> None:
    times_s = []  # of the processor: the machine may be busy with other things
    for _ in range(5):
        adapter.cache_clear()
        started_s = process_time()
        assert check_report("demo").rig is not None
        times_s.append(process_time() - started_s)
    assert min(times_s) < 0.150
