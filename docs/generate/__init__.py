"""Writes the generated pages of the reference: `python -m generate FOLDER`, called by docs/conf.py at each build."""
