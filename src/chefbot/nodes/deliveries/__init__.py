"""The parts of the delivery node: energy of its ways, its round, and the forecast of its stops."""
