"""One frame as SVG, for a document. Self-contained: rich's own template fetches a font from the web, this one does not."""

import io
import re
from typing import Final

from rich.console import Console
from rich.text import Text

from gateway.cli.live_monitor.page import page
from gateway.cli.live_monitor.register_table import View

_WEB_FONT: Final = re.compile(r"@font-face \{.*?\}\s*", re.DOTALL)


def svg_picture(view: View) -> str:
    """Return the frame as the text of an SVG file."""
    console = Console(
        record=True,
        width=view.width,
        height=view.height,
        file=io.StringIO(),
        force_terminal=True,
        color_system="truecolor",
    )
    console.print(Text("\n").join(page(view)))
    return _WEB_FONT.sub("", console.export_svg(title=f"force-gateway monitor  {view.where}", unique_id="monitor"))
