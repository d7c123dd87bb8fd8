// Numbers as people type them, in fields of text: one of type number drops a comma as it is typed, and 1,5 N became 15 N.

/** Returns the number, NaN where the text is none; a comma is a decimal point: of some phones' keypads it is the only one. */
export function typedNumber(text) {
  const words = text.trim().replace(",", ".");
  return words === "" ? NaN : Number(words);
}
