"""Pose by counting wheel turns, and by counting them together with a gyro."""
