"""From the accepted force to the voltage: feedforward, lead compensation, bounded trim, limits."""
