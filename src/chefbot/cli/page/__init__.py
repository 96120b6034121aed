"""Commands of `chefbot page`."""
