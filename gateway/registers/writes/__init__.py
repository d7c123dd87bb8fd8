"""What a master writes: decoded field by field, checked as one snapshot, owned by one host, asked of control, then stored."""
