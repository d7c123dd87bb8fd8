"""The generator and the judge are plain modules beside the tests: their directory goes on the path, here and nowhere else."""

import sys
from pathlib import Path

HERE = str(Path(__file__).parent)
if HERE not in sys.path:
    sys.path.insert(0, HERE)
