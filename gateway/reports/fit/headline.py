"""The answer of a fit in one sentence, and how it reverses: the same words in the terminal and on the page."""

from typing import Any

from gateway.reports.fit.names import spell_model, spell_reversal


def answer_sentence(document: dict[str, Any]) -> str:
    """Return `BSFM, order 2, with 2 slip stops describes this machine to 0.21 N RMS, 0.80 N at most`.

    The order is that of the model that is activated: slip stops may have moved the chosen fit's branches to another one.
    """
    measured, order = document["measured"], len(document["model"]["rising_weights"]) - 1
    model = spell_model(document["chosen"]["model"], order)
    return (
        f"{model}, with {policy(document['reversal'])} describes this machine to {measured['rms_n']:.3f} N RMS, "
        f"{measured['max_n']:.2f} N at most"
    )


def policy(reversal: dict[str, Any]) -> str:
    """Return how the command turns back within the loop."""
    return spell_reversal(reversal.get("stops", 0), reversal["span_n"])


def reversal_sentence(reversal: dict[str, Any]) -> str:
    """Say how well the reversal policy holds inside the loop, and how well switching branches would."""
    if not reversal["identified"]:
        return f"Reversals were not measured: {policy(reversal)} is assumed."
    return (
        f"Reversals inside the loop: {policy(reversal)}, off by {reversal['rms_n']:.2f} N RMS and {reversal['max_n']:.2f} N "
        f"at most; switching branches at once would be off by {reversal['switched_rms_n']:.2f} N RMS."
    )
