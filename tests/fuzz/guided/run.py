"""Search a target's inputs by what they reach: `python -m tests.fuzz.guided.run TARGET FOLDER [libFuzzer's options]`.

FOLDER keeps the inputs that reached something new, and a second run goes on from them. By atheris, which is libFuzzer for
Python (needs `pip install atheris`); -runs=N and -max_total_time=S bound it. What breaks a law ends it with a traceback and
the input as a file beside FOLDER; `FOLDER/FILE` in place of FOLDER plays that one again.
"""

import sys
from hashlib import sha256
from pathlib import Path

import atheris  # type: ignore[import-not-found]

with atheris.instrument_imports(include=["gateway"]):
    from tests.fuzz.guided.targets import TARGETS


def main() -> None:
    name, folder, *options = sys.argv[1:]
    target, inputs = TARGETS[name], Path(folder)
    if not inputs.is_file():
        inputs.mkdir(parents=True, exist_ok=True)
        for seed in target.seeds():
            (inputs / sha256(seed).hexdigest()[:16]).write_bytes(seed)
    found = f"-artifact_prefix={inputs.parent}/{name}-"
    atheris.Setup([sys.argv[0], f"-max_len={target.longest}", found, *options, folder], target.assert_lawful)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
