"""The style of reports and page: its colours can be told apart and read, in light and dark, and both say the same names."""

import re

import pytest

from gateway.reports.style import inline_style, read_style

GROUNDS = ("paper", "tile")
TEXTS = ("ink", "dim", "accent", "good-ink", "warn-ink", "bad-ink")
LINES = (
    "rising", "falling", "measured", "before", "after", "pfm", "psfm", "bfm", "bsfm", "warn-edge", "focus", "stop", "accent",
)  # fmt: skip
ON_THEIR_GROUND = (
    ("good-ink", "good"), ("warn-ink", "warn"), ("bad-ink", "bad"), ("ink", "warn"), ("ink", "good"), ("dim", "warn"),
    ("on-accent", "accent"), ("on-stop", "stop"),
)  # fmt: skip
TEXT_CONTRAST, LINE_CONTRAST = 4.5, 3.0  # WCAG 2.2, level AA


def palettes() -> dict[str, dict[str, str]]:
    """The colours of each theme, by the selector that sets them."""
    blocks = re.findall(r"(:root[^{]*)\{([^}]*)\}", read_style())
    return {selector.strip(): dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", block)) for selector, block in blocks}


def luminance(colour: str) -> float:
    """Relative luminance of sRGB, as WCAG defines it."""
    parts = [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one: str, other: str) -> float:
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def test_contrast_is_computed_as_defined() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.01)


@pytest.mark.parametrize("theme", sorted(palettes()))
def test_text_and_lines_stand_out_from_their_ground(theme: str) -> None:
    colours = palettes()[theme]
    pairs = [(text, ground, TEXT_CONTRAST) for text in TEXTS for ground in GROUNDS]
    pairs += [(line, ground, LINE_CONTRAST) for line in LINES for ground in GROUNDS]
    pairs += [(text, ground, TEXT_CONTRAST) for text, ground in ON_THEIR_GROUND]
    low = [
        f"{one} on {ground}: {contrast(colours[one], colours[ground]):.2f}"
        for one, ground, least in pairs
        if contrast(colours[one], colours[ground]) < least
    ]
    assert low == []


def test_dark_is_the_same_by_system_and_by_attribute_and_names_what_light_names() -> None:
    light, by_system, by_attribute = palettes().values()
    assert by_system == by_attribute
    assert light.keys() == by_system.keys()


def test_what_a_report_carries_is_the_file_without_comments() -> None:
    carried = inline_style()
    assert "/*" not in carried and "  " not in carried and "\n" not in carried
    assert len(carried) < 0.95 * len(read_style())
    assert carried.count("{") == carried.count("}") == read_style().count("{")


def test_the_style_asks_for_nothing_outside_and_knows_motion_and_paper() -> None:
    style = read_style()
    assert not re.search(r"url\(|@import|https?:", style)
    assert "prefers-reduced-motion" in style and "@media print" in style
