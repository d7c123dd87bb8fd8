"""The two lines of a running rig: questions and answers, kept in step, and what is said of a line that stays silent."""
