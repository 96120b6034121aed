"""The Robot: a frozen value read from a robot file."""
