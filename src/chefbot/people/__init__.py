"""Tracking and prediction of people in laser scans and depth images."""
