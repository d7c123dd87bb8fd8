"""tools/paper is a package beside the project's own: its directory goes on the path, here and nowhere else."""

import sys
from pathlib import Path

TOOLS = str(Path(__file__).parents[2] / "tools")
if TOOLS not in sys.path:
    sys.path.insert(0, TOOLS)
