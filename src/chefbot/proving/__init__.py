"""Proving: scenarios run hundreds of times with different seeds, their statistics, and what fails made small."""
