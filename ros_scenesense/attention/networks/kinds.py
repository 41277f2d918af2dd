"""The kinds of networks by name, each with the dataclass that says what one looks like."""

from __future__ import annotations

from typing import Any

import torch
from torch import nn

from ros_scenesense.attention.networks.alexnet import AlexNet, AlexNetConfiguration
from ros_scenesense.attention.networks.lenet import LeNet, LeNetConfiguration
from ros_scenesense.attention.networks.query import QueryNetwork, QueryNetworkConfiguration

NetworkConfiguration = LeNetConfiguration | AlexNetConfiguration | QueryNetworkConfiguration

KINDS: dict[str, tuple[type[NetworkConfiguration], type[nn.Module]]] = {
    "lenet": (LeNetConfiguration, LeNet),
    "alexnet": (AlexNetConfiguration, AlexNet),
    "query": (QueryNetworkConfiguration, QueryNetwork),
}
"""Configuration and network by name."""


def kind_of(configuration: NetworkConfiguration) -> str:
    """The name of the kind that a configuration describes."""
    return next(name for name, (each, _) in KINDS.items() if type(configuration) is each)


def build(configuration: NetworkConfiguration, seed: int) -> nn.Module:
    """A network with weights drawn from a seed; torch's global randomness is left as it was."""
    network: Any = KINDS[kind_of(configuration)][1]
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        module: nn.Module = network(configuration)
        return module
