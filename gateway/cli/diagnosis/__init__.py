"""What `diagnose` and `simulate` share: recordings and plants by name, files all or none, words for a terminal."""
