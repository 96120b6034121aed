"""Implementation of `chefbot fleet`: keys and certificates of the members of a fleet."""
