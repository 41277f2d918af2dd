"""Datasets of simulated scenes on disk: made, resumed, verified, read, counted and shown."""
