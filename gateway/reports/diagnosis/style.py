"""What the report of a diagnosis adds to the look of a fit's."""

from typing import Final

from gateway.reports.style import STYLE

DIAGNOSIS_STYLE: Final = (
    STYLE
    + """
:root{--before:#c2410c;--after:#1d5fb4;--measured:#8d949c}
@media (prefers-color-scheme:dark){:root{--before:#fb923c;--after:#6eb1ff;--measured:#737b84}}
.before{stroke:var(--before)}.after{stroke:var(--after)}.measured{stroke:var(--measured)}
.band{stroke-width:1;stroke-linejoin:round;fill-opacity:.75}
.band.before{fill:var(--before)}.band.after{fill:var(--after)}.band.measured{fill:var(--measured)}
.cloud{fill:none;stroke-width:1;stroke-opacity:.28}.cloud.wider{stroke-width:2;stroke-linecap:round;stroke-opacity:.6}.cloud.strong{stroke-width:1;stroke-opacity:.9}
.band.measured{stroke-width:5;stroke-opacity:.75}.line.measured{stroke-width:5;stroke-opacity:.75}
.pair{grid-template-columns:repeat(auto-fill,minmax(min(100%,420px),1fr))}
.thick{stroke-width:2.2}
.line.halo{stroke:var(--paper);stroke-width:5}
.key{margin:0 0 .2rem;font-size:.85rem;min-height:1.3em}
.key span{margin-right:1.1rem;white-space:nowrap}
.key i{display:inline-block;width:1.3em;height:.62em;margin-right:.4em;border-radius:2px;background:currentColor}
.key i[class*=before]{background:var(--before)}.key i[class*=after]{background:var(--after)}
.key i[class*=measured]{background:var(--measured)}
.key i[class*=rising]{background:var(--rising)}.key i[class*=falling]{background:var(--falling)}
.verdict{font-size:1.05rem;color:var(--ink)}
figure.full{margin:1rem 0}figure.across{grid-column:1/-1;min-width:0}
figure.full,figure.across{overflow-x:auto}figure.full svg,figure.across svg{min-width:720px}
.causes{width:100%}.causes td{white-space:nowrap}.causes tbody th{color:var(--ink);max-width:26rem;font-weight:400}
small{color:var(--dim);font-size:.82rem}
small.alike{color:var(--ink)}
.unseen tbody th{white-space:nowrap}
.numbers{width:100%}.numbers td,.numbers th+th{text-align:right}
.meter{display:inline-block;width:5rem;height:.6rem;border-radius:3px;background:var(--grid);vertical-align:baseline}
.meter i{display:block;height:100%;border-radius:3px;background:var(--after)}
ol.next{padding-left:2rem}ol.next li{margin:.3rem 0}
details summary{cursor:pointer;color:var(--dim)}
@media print{details::details-content{content-visibility:visible;block-size:auto}
figure.full,figure.across{overflow:visible}figure.full svg,figure.across svg{min-width:0}h2{break-after:avoid}
.causes td{white-space:normal}.causes tbody th{max-width:none;min-width:7rem}.unseen tbody th{white-space:normal}
.meter{width:2.5rem}table{font-size:.85em}ol.next{padding-left:2rem}@page{margin:14mm}
.meter,.meter i,.band,.key i{-webkit-print-color-adjust:exact;print-color-adjust:exact}}
"""
)
