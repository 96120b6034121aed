"""The parts of the delivery node: energy of its routes, its round, and the forecast of its stops."""
