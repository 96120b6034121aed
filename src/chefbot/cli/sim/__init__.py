"""Implementation of `chefbot sim`: the simulator's worlds."""
