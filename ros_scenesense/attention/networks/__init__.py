"""The networks and their training, in PyTorch.

These modules import torch, which takes seconds: import them only in functions that run in a worker.
"""
