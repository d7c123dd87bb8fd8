"""What a file is, by its first bytes, and how a table is got out of it: for sentences about a file of the wrong kind."""

import re
from typing import Final

SIGNATURE_BYTES: Final = 520
"""As many first bytes are enough."""
JSON: Final = "a JSON document"
_SIGNATURES: Final[tuple[tuple[bytes, str, str], ...]] = (
    (b"\x89FGR1", "a recording of force-gateway", ""),
    (b"PAR1", "a Parquet table", ""),
    (b"\x89PNG", "a PNG picture", ""),
    (b"\xff\xd8\xff", "a JPEG picture", ""),
    (b"GIF8", "a GIF picture", ""),
    (b"%PDF", "a PDF document", ""),
    (b"\x1f\x8b", "a gzip file", "unpack it first (gunzip)"),
    (b"BZh", "a bzip2 file", "unpack it first (bunzip2)"),
    (b"\xfd7zXZ", "an xz file", "unpack it first (unxz)"),
    (b"\x28\xb5\x2f\xfd", "a zstd file", "unpack it first (unzstd)"),
    (b"7z\xbc\xaf", "a 7z archive", "unpack it first"),
    (b"PK\x03\x04", "an Excel or zip file", "save the sheet as CSV"),
    (b"PK\x05\x06", "an empty zip file", ""),
    (b"\xd0\xcf\x11\xe0", "an old Excel file (.xls)", "save the sheet as .xlsx or CSV"),
    (
        b"TDSm",
        "a TDMS file (LabVIEW, DIAdem)",
        "export it as CSV, in LabVIEW or DIAdem, or by npTDMS: TdmsFile(FILE).as_dataframe(time_index=True).to_csv(OUT)",
    ),
    (
        b"MATLAB",
        "a MATLAB file (.mat)",
        "in MATLAB: writetable(table(time_s, command_v, force_n), 'recording.csv')",
    ),
    (b"\x89HDF", "an HDF5 or MATLAB 7.3 file", "write its columns as CSV or Parquet (pandas: to_csv)"),
    (
        b"\x93NUMPY",
        "a NumPy file",
        "write it as CSV: numpy.savetxt(OUT, table, delimiter=',', header='time_s,command_v,force_n', comments='')",
    ),
    (b"ARROW1", "an Arrow (Feather) file", "write it as Parquet (pandas: to_parquet)"),
    (b"SQLite format 3", "an SQLite database", "write the table as CSV: sqlite3 -header -csv FILE 'select * from ...'"),
    (b"MDF     ", "an MDF measurement file", "export it as CSV (asammdf: export(fmt='csv'))"),
    (b"\x7fELF", "a program", ""),
    (b"\xed\xab\xee\xdb", "a package", ""),
    (b"-----BEGIN ", "a certificate or key", ""),
)
_TEXTS: Final = (
    (re.compile(rb"<!doctype html|<html", re.IGNORECASE), "a web page (HTML)", ""),
    (re.compile(rb"<\?xml|<svg", re.IGNORECASE), "an XML file", ""),
    (re.compile(rb"\{\s*(\"|\}|$)|\[\s*[\[{\"]"), JSON, ""),
    (re.compile(rb"\\documentclass|\{\\rtf"), "a text document", ""),
    (re.compile(rb"#!"), "a script", ""),
)
_TAR: Final = (257, b"ustar")


def describe_signature(start: bytes) -> tuple[str, str] | None:
    """Return (what it is, how to get a table out of it or "") for a file that begins so; None for what may be a table."""
    for magic, what, cure in _SIGNATURES:
        if start.startswith(magic):
            return what, cure
    if start[_TAR[0] :].startswith(_TAR[1]):
        return "a tar archive", "unpack it first"
    text = start.removeprefix(b"\xef\xbb\xbf").lstrip()
    return next(((what, cure) for shape, what, cure in _TEXTS if shape.match(text)), None)
