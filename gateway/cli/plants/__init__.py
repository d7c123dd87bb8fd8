"""What the verb `plant` and `diagnose --save` share: the store as a user meets it, and what is said of a plant."""
