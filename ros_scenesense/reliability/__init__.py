"""Tries the running graph: for an hour, with nodes killed, with nonsense on every topic."""
