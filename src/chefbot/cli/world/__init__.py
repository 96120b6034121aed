"""Implementation of `chefbot world`: worlds for the simulator, listed, generated and drawn."""
