"""YAML read strictly into typed values, every fault with its line and column in the user's words."""
