"""E: what a tab of the page could not do. The page says it in the tab; the gateway goes on."""

from typing import Final

from gateway.codes.explanation import Explanation

PAGE_ERRORS: Final = (
    Explanation(
        "E177",
        "a run of the page is under way",
        "A calibration was to be started on the page while one that was started there still runs.",
        "Another browser has started it, or this one has before it was loaded again.",
        "Wait for its end in the tab Calibrate, or stop it there: the force goes to 0 and the data are kept.",
    ),
    Explanation(
        "E178",
        "a command of the page has not answered",
        "The page had one of the gateway's own commands do something, and it did not come to an end in time.",
        "The machine is very busy, or the disk that the state directory is on hangs.",
        "Try it again; run the same command in a terminal (with --state) to see what it waits for.",
    ),
    Explanation(
        "E179",
        "a diagnosis is under way",
        "A diagnosis was to be started on the page while another one runs; there is one at a time.",
        "Another browser has started it, or this one has before it was loaded again.",
        "Wait for it or cancel it in the tab Diagnosis; `force-gateway diagnose` in a terminal waits for nobody.",
    ),
)
