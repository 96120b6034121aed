"""The web UI: its server, its protocol and a client for programs."""
