"""Coverage and mutation gate of all Python code between a twist and the wheels."""
