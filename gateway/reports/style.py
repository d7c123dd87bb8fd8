"""The look of a report: system fonts, two colours for the two branches, light and dark by the reader's choice."""

from typing import Final

STYLE: Final = """
:root{--paper:#fdfdfc;--ink:#1c2024;--dim:#646b73;--rule:#dfe2e6;--grid:#eceef0;--tile:#f4f5f6;--rising:#c2410c;--falling:#1d5fb4;
--pfm:#8a8f98;--psfm:#7c3aed;--bfm:#b08900;--bsfm:#047857;--good:#e8f5ee;--warn:#fff7e6;--warn-edge:#e0a100}
@media (prefers-color-scheme:dark){:root{--paper:#15181b;--ink:#e6e8ea;--dim:#98a1aa;
--rule:#343a40;--grid:#262b30;--tile:#1e2226;
--rising:#fb923c;--falling:#6eb1ff;--pfm:#9aa2ab;--psfm:#b794f6;--bfm:#e3c04b;--bsfm:#4ade9f;--good:#16301f;--warn:#2c2411;--warn-edge:#b8860b}}
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink);font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
main{max-width:1180px;margin:0 auto;padding:2rem 1.5rem 4rem}
h1{font-size:1.9rem;margin:.1rem 0 .3rem;letter-spacing:-.01em}
h2{font-size:1.2rem;margin:2.4rem 0 .8rem}
h3{font-size:.95rem;margin:0 0 .4rem}
header p{margin:0;color:var(--dim)}
.kicker{font-size:.85rem}
.tiles{display:flex;flex-wrap:wrap;gap:.75rem;margin:1.5rem 0}
.tiles div{flex:1 1 9rem;background:var(--tile);border-radius:8px;padding:.7rem .9rem}
.tiles dt{font-size:.8rem;color:var(--dim)}
.tiles dd{margin:0;font-size:1.45rem;font-variant-numeric:tabular-nums}
.tiles dd.unit{font-size:.8rem;color:var(--dim)}
.notes{background:var(--warn);border-left:4px solid var(--warn-edge);border-radius:4px;padding:.7rem 1rem;margin:1.2rem 0}
.notes h2{margin:0 0 .2rem;font-size:.95rem}
.notes ul{margin:0;padding-left:1.2rem}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,420px),1fr));gap:1.6rem;
align-items:start;margin:1rem 0}
figure{margin:0;break-inside:avoid}
figcaption,.small{color:var(--dim);font-size:.85rem}
svg{display:block;width:100%;height:auto}
svg text{font:12px system-ui,sans-serif;fill:var(--dim);text-anchor:middle}
svg text.end{text-anchor:end}
svg text.key{text-anchor:start;fill:var(--ink)}
svg text.name{fill:var(--ink)}
.grid{stroke:var(--grid);fill:none}
.level{stroke:var(--dim);fill:none;stroke-width:1}
.line{fill:none;stroke-width:1.7;stroke-linejoin:round}
.thin{stroke-width:1}
.faint{opacity:.45}
.ring{fill:none;stroke:var(--ink);stroke-width:1.5}
.rising{stroke:var(--rising)}.falling{stroke:var(--falling)}.walk{stroke:var(--bsfm)}.switched{stroke:var(--dim)}
.pfm{stroke:var(--pfm)}.psfm{stroke:var(--psfm)}.bfm{stroke:var(--bfm)}.bsfm{stroke:var(--bsfm)}
.dots{stroke:none}
.dots.rising{fill:var(--rising);fill-opacity:.55}.dots.falling{fill:var(--falling);fill-opacity:.55}.dots.walk{fill:var(--bsfm)}
.dots.pfm{fill:var(--pfm)}.dots.psfm{fill:var(--psfm)}.dots.bfm{fill:var(--bfm)}.dots.bsfm{fill:var(--bsfm)}
.dots.hollow{fill:var(--paper);stroke-width:1.5}
.dots.hollow.pfm{stroke:var(--pfm)}.dots.hollow.psfm{stroke:var(--psfm)}.dots.hollow.bfm{stroke:var(--bfm)}.dots.hollow.bsfm{stroke:var(--bsfm)}
.wide{overflow-x:auto}
table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:.9rem}
table.fits{width:100%;margin-top:1rem}
table.fits td:not(.words){white-space:nowrap}
th,td{text-align:left;padding:.28rem .8rem .28rem 0;border-bottom:1px solid var(--rule);vertical-align:top}
thead th{color:var(--dim);font-weight:500}
tbody th{font-weight:500;color:var(--dim)}
tr.chosen td{background:var(--good);font-weight:600}
tr.unusable td{color:var(--dim)}
.facts td{overflow-wrap:anywhere}
@media print{body{font-size:11px}main{max-width:none;padding:0}.tiles div,
.notes{border:1px solid var(--rule)}tr{break-inside:avoid}}
"""
