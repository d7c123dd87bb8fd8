"""C from a calibration: one header and one source, float32, for a controller that has no gateway beside it.

The C text lies beside this file in templates/, with ${...} where a calibration's numbers and names go; the inverse has a
template per order (1, 2, above), the reversal one per policy (linear blend, slip stops). Decisions: coefficients are
constants in the source, so that there is nothing to initialise; loops over a constant order and number of stops instead of
unrolled formulas, so that order 15 stays readable; NaN is found by its bits, because -ffast-math deletes comparisons with
it; no assert, no double, no libm beyond sqrtf (none for order 1). The measured response is told, not used: this code has
no time in it.
A double rounded to float32 is written with nine digits, which is exact.
"""

import re
from importlib.resources import files
from string import Template
from typing import Final

from gateway import VERSION
from gateway.bsfm.c_export.accuracy import SelfTest, self_test_of
from gateway.bsfm.c_export.float32_model import CLOSE, ROUNDS_MAX
from gateway.bsfm.c_export.tables import BranchTable, Tables, round_to_float32, tables_of
from gateway.bsfm.model import Calibration

TEXT_LENGTH = 200  # characters of a calibration's own texts in a comment
PER_LINE = 4
SOURCE_PARTS = ("source.c", "self_test.c")


def c_source(calibration: Calibration) -> dict[str, str]:
    """Return {"bsfm_NAME.h": text, "bsfm_NAME.c": text}, the same for the same calibration; plain ASCII.

    NAME is the calibration's, with what C does not allow in a name replaced by "_". ValueError with a sentence if the
    calibration is no model, or if float32 cannot follow it.
    """
    tables = tables_of(calibration)
    test = self_test_of(calibration, tables)
    names = {**_texts(calibration), **_numbers(calibration, tables), **_tests(tables, test), **_code(tables)}
    names |= _reversal(calibration, tables, names)
    return {
        f"{names['p']}.h": Template(_template("header.h")).substitute(names),
        f"{names['p']}.c": "\n".join(Template(_template(part)).substitute(names) for part in SOURCE_PARTS),
    }


def _template(name: str) -> str:
    return files("gateway.bsfm.c_export").joinpath("templates", name).read_text("utf-8")


def _texts(calibration: Calibration) -> dict[str, str]:
    word = re.sub(r"[^A-Za-z0-9]+", "_", calibration.name).strip("_") or f"calibration_{calibration.number}"
    own = {"title": "name", "date": "date_utc", "rig": "rig", "source": "source", "sha256": "data_sha256"}
    return {
        "p": f"bsfm_{word}",
        "P": f"BSFM_{word.upper()}",
        "version": VERSION,
        **{name: _comment_text(getattr(calibration, field)) for name, field in own.items()},
    }


def _comment_text(text: str) -> str:
    """One line of ASCII that can neither end a comment nor open one, nor be a trigraph."""
    printable = "".join(c if c.isprintable() else " " for c in text)
    line = " ".join(printable.split())[:TEXT_LENGTH].encode("ascii", "backslashreplace").decode()
    return re.sub(r"\*(?=/)|/(?=\*)|\?(?=\?)", r"\g<0> ", line) or "unknown"


def _numbers(calibration: Calibration, tables: Tables) -> dict[str, str]:
    (low_n, high_n), (lowest_n, highest_n) = tables.shared_n, tables.reached_n
    figures = {
        "x0": tables.x0_v,
        "x1": tables.x1_v,
        "force_min": low_n,
        "force_max": high_n,
        "span": tables.blend_span_n,
    }
    exact = {
        **figures,
        "x_span": tables.x_span_v,
        "lowest": lowest_n,
        "highest": highest_n,
        "close": round_to_float32(CLOSE),
    }
    return {
        "number": str(calibration.number),
        "order": str(tables.order),
        "rms": f"{calibration.rms_n:.3g}",
        "largest": f"{calibration.max_n:.3g}",
        **{name: f"{value:g}" for name, value in figures.items()},
        **{f"{name}_f": _literal(value) for name, value in exact.items()},
    }


def _tests(tables: Tables, test: SelfTest) -> dict[str, str]:
    lowest_n, highest_n = tables.reached_n
    beyond_n = 0.5 * (highest_n - lowest_n)
    return {
        "error_n": f"{test.error_n:.1e}",
        "error_v": f"{test.error_v:.1e}",
        "tolerance_n": f"{test.tolerance_n:g}",
        "tolerance_v": f"{test.tolerance_v:g}",
        "tolerance_n_f": _literal(test.tolerance_n),
        "tolerance_v_f": _literal(test.tolerance_v),
        "below_f": _literal(lowest_n - beyond_n),
        "above_f": _literal(highest_n + beyond_n),
        "point_count": str(len(test.points)),
        "points": _rows(test.points),
        "reversal_count": str(len(test.reversals)),
        "reversals": _rows(test.reversals),
    }


def _code(tables: Tables) -> dict[str, str]:
    newton = tables.order > 2
    root = tables.order > 1
    return {
        "constants": f"ORDER = {tables.order}" + (f", ROUNDS_MAX = {ROUNDS_MAX}" if newton else ""),
        "math_include": "#include <math.h>\n" if root else "",
        "libm": ", of libm only sqrtf" if root else ", no libm",
        "inverse": Template(_template("inverse_n.c" if newton else f"inverse_{tables.order}.c")).substitute(
            close_f=_literal(CLOSE)
        ),
        "fields": "\n".join(f"    {declared} /* {meaning} */" for declared, meaning, _ in _fields(tables.rising)),
        "rising": _initialiser(tables.rising),
        "falling": _initialiser(tables.falling),
    }


def _reversal(calibration: Calibration, tables: Tables, names: dict[str, str]) -> dict[str, str]:
    """Texts that depend on the policy, and its templates filled in. names: what they need beside."""
    policy = "slip" if tables.radii_v else "blend"
    own = _slip(tables) if tables.radii_v else _BLEND
    response = calibration.response
    lags = ""
    if response:
        rings = f", damping {response.damping:g}" if response.damping else ""
        lags = f"dead time {response.dead_time_s:g} s, lags {response.lag_s:g} and {response.second_lag_s:g} s{rings}"
    response_note = {"response_told": f" *   response     {lags}: not in this code\n" if lags else ""}
    filled = {
        name: Template(_template(f"reversal_{policy}{end}")).substitute({**names, **own}).rstrip("\n") + last
        for name, end, last in (("reversal", ".c", "\n"), ("reversal_api", ".h", "\n"))
    }
    return {**own, **response_note, **filled, "reversal_told": Template(own["reversal_told"]).substitute(names)}


_BLEND: Final = {
    "reversal_told": "linear blend of the branches over $span N",
    "memory": "    float blend;     /* 1 on the rising branch, -1 on the falling one, between them after a reversal */",
    "rest": ", rising",
}


def _slip(tables: Tables) -> dict[str, str]:
    stops = len(tables.radii_v)
    radii = ", ".join(f"{radius_v:.3g}" for radius_v in tables.radii_v)
    return {
        "reversal_told": f"slip stops: {stops}, which give way over {radii} V",
        "memory": f"    float places[{stops}]; /* of the slip stops, -1 .. 1: where they stand since the last reversals */",
        "rest": ", fallen there",
        "stops": str(stops),
        "radii": _wrap(tables.radii_v),
        "shares": _wrap(tables.shares),
        "stiffness_f": _literal(tables.stiffness_per_v),
    }


def _fields(table: BranchTable) -> list[tuple[str, str, tuple[float, ...]]]:
    """Members of the branch struct: declaration, meaning, values."""
    common = [
        ("float handles_n[ORDER + 1];", "b_i", table.handles_n),
        ("float totals[ORDER + 1];", "C(n,i) w_i", table.totals),
        ("float products[ORDER + 1];", "C(n,i) w_i b_i", table.products),
    ]
    if len(table.handles_n) > 3:
        return [*common, ("float half_n;", "force at t = 1/2", (table.half_n,))]
    return [*common, ("float weights[ORDER + 1];", "w_i", table.weights)]


def _initialiser(table: BranchTable) -> str:
    lines = [
        f"    {_wrap(values) if '[' in declared else _literal(values[0])}," for declared, _, values in _fields(table)
    ]
    return "\n".join(lines).removesuffix(",")


def _wrap(values: tuple[float, ...]) -> str:
    literals = [_literal(value) for value in values]
    lines = [", ".join(literals[i : i + PER_LINE]) for i in range(0, len(literals), PER_LINE)]
    return "{ " + ",\n      ".join(lines) + " }"


def _rows(rows: tuple[tuple[float, ...], ...]) -> str:
    return ",\n".join("    { " + ", ".join(map(_literal, row)) + " }" for row in rows)


def _literal(value: float) -> str:
    """Nine digits give the same float32 back; negative ones in brackets, because macros are pasted."""
    digits = f"{value:.9g}"
    literal = (digits if re.search(r"[.e]", digits) else digits + ".0") + "f"
    return f"({literal})" if literal.startswith("-") else literal
