"""SERVE: a running moldline, and the client that talks to it."""
