"""Implementation of `chefbot board`: the motor board at a serial port, and its firmware."""
