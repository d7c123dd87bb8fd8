"""The audit: who wrote what of consequence, accepted and refused, in a chain of lines that shows where it was altered."""
