"""When our processes get a processor: the priority they take, and what the kernel counts where they got none."""
