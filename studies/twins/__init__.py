"""What simulated machines say of designs."""
