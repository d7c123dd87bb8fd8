"""What `fleet` computes of one recording, and what it writes of all."""
