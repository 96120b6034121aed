"""Robots that a seed draws: numbers from ranges, everything else derived by the sizing calculations."""
