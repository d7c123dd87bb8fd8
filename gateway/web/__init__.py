"""The page: what a person watches and steers a rig by in a browser, in a process of its own."""
