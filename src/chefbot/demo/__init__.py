"""The demo: a scored run of mapping, localization and delivery."""
