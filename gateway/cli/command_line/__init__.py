"""What stands on a command line: which rig is meant, words that a shell completes, examples of each verb, refused numbers."""
