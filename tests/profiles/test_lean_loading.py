"""`check` answers at once: nothing heavy is imported, and a rig loads in less than a blink."""

import subprocess
import sys
from time import perf_counter

from gateway.profiles import check_report
from gateway.profiles.strict_yaml.typed import adapter

HEAVY = ("scipy", "pandas", "matplotlib", "jinja2", "pyarrow", "pymodbus", "serial", "asyncio")


def test_loading_a_rig_imports_nothing_heavy() -> None:
    source = f"import sys, gateway.profiles as p; p.load_rig('demo'); print([m for m in {HEAVY!r} if m in sys.modules])"
    answer = subprocess.run([sys.executable, "-c", source], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"


def test_the_demo_rig_loads_within_150_ms_validators_included() -> None:
    times_s = []
    for _ in range(5):
        adapter.cache_clear()
        started_s = perf_counter()
        assert check_report("demo").rig is not None
        times_s.append(perf_counter() - started_s)
    assert min(times_s) < 0.150
