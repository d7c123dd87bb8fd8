"""Every report in a real browser, on a telephone and on larger screens: nothing sticks out, no two words of a chart touch."""

import html
import json
import re
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from tests.browser import BROWSER, FLAGS, NO_BROWSER
from tests.reports.sample_pages import PAGES

TELEPHONE_PX, DESK_PX, WALL_PX = 400, 1280, 2560
GROUNDS = {"dark": "rgb(21, 24, 27)", "light": "rgb(253, 253, 252)"}
MEASURE = """
const found = [];
const seen = (box) => box.width > 0 && box.height > 0;
const clipped = (element) => element.closest('.wide, .picture, pre, details:not([open])');
for (const frame of document.querySelectorAll('iframe')) {
  const page = frame.contentDocument, width = frame.clientWidth, beyond = [], touching = [];
  for (const element of page.querySelectorAll('main *')) {
    const box = element.getBoundingClientRect();
    // of a drawing: half a stroke may reach out
    const part = element.closest('svg') && !element.matches('text');
    if (!part && seen(box) && !clipped(element) && (box.right > width + 0.5 || box.left < -0.5))
      beyond.push(`${element.tagName}.${element.getAttribute('class')} ${element.textContent.slice(0, 40)} ${box.right}`);
  }
  for (const plot of page.querySelectorAll('.plot')) {
    const texts = [...plot.querySelectorAll('text:not(.words)')];
    const words = texts.map(text => [text.textContent, text.getBoundingClientRect()]);
    const shown = words.filter(([, box]) => seen(box));
    shown.forEach(([one, a], k) => shown.slice(k + 1).forEach(([other, b]) => {
      const across = a.left < b.right && b.left < a.right, down = a.top + 3 < b.bottom && b.top + 3 < a.bottom;
      if (across && down) touching.push(`${one} | ${other}`);
    }));
  }
  found.push({name: frame.title, width, scroll: page.documentElement.scrollWidth, beyond, touching,
    texts: page.querySelectorAll('.plot text').length, height: page.documentElement.scrollHeight,
    ground: getComputedStyle(page.body).backgroundColor});
}
document.title = 'done';
document.body.textContent = JSON.stringify(found);
"""


def measured(pages: Mapping[str, str], folder: Path, width_px: int, themes: tuple[str, ...]) -> list[dict[str, Any]]:
    """Each page in a frame of this width and each theme, all in one start of the browser."""
    assert BROWSER is not None
    frames = []
    for name, page in pages.items():
        for theme in themes:
            themed = page.replace('<html lang="en">', f'<html lang="en" data-theme="{theme}">')
            size = f"width:{width_px}px;height:800px;border:0"
            frames.append(f'<iframe title="{name} {theme}" style="{size}" srcdoc="{html.escape(themed)}"></iframe>')
    script = f"<script>window.addEventListener('load', () => {{ {MEASURE} }});</script>"
    (folder / "frames.html").write_text(f"<!doctype html><body>{''.join(frames)}{script}</body>", encoding="utf-8")
    quiet = [
        "--headless",
        *FLAGS,
        f"--user-data-dir={folder / 'browser'}",
        "--window-size=1400,900",
    ]
    command = [BROWSER, *quiet, "--virtual-time-budget=2000", "--dump-dom", (folder / "frames.html").as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    body = re.search(r"<body[^>]*>(.*)</body>", done.stdout, re.DOTALL)
    assert body is not None, done.stdout[:500]
    found: list[dict[str, Any]] = json.loads(html.unescape(body[1]))
    return found


@pytest.mark.skipif(BROWSER is None, reason=NO_BROWSER)
@pytest.mark.parametrize(
    ("width_px", "themes"),
    [
        (TELEPHONE_PX, ("dark",)),
        *(pytest.param(width, tuple(GROUNDS), marks=pytest.mark.long) for width in (TELEPHONE_PX, DESK_PX, WALL_PX)),
    ],
)
def test_no_report_is_wider_than_the_screen_and_no_words_of_a_chart_touch(
    tmp_path: Path, width_px: int, themes: tuple[str, ...]
) -> None:
    found = measured({name: make() for name, make in PAGES.items()}, tmp_path, width_px, themes)
    assert [each["name"] for each in found] == [f"{name} {theme}" for name in PAGES for theme in themes]
    for each in found:
        where = f"{each['name']} at {width_px} px"
        assert each["scroll"] <= width_px + 1, where
        assert each["beyond"] == [], where
        assert each["touching"] == [], where
        assert each["texts"] > 20 and each["height"] > 1000, where
        assert each["ground"] == GROUNDS[each["name"].split()[1]], where
