"""Implementation of the commands that stand alone: `chefbot demo`, `chefbot launch` and `chefbot replay`."""
