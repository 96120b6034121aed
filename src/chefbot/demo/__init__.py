"""The demo run with its score and report."""
