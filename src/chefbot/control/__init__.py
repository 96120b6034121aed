"""From a path to wheel speeds."""
