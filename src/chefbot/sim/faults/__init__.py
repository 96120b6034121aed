"""Fault injection: what breaks at which time, and where it acts in the simulated robot and its nodes."""
