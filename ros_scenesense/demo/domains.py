"""Picks the ROS domain of a run, so that two runs on one machine do not hear each other."""

from __future__ import annotations

import os
import random
import socket

from ros_scenesense.errors import ParameterError

LAST_DOMAIN = 101
"""Above this the ports of a domain fall into the range that Linux gives to anybody."""


def choose_domain(wanted: int | None) -> int:
    """The wanted domain, else the user's `ROS_DOMAIN_ID`, else one that nobody uses here.

    Raises:
        ParameterError: If `ROS_DOMAIN_ID` is not a domain, or every domain is taken.
    """
    if wanted is not None:
        return wanted
    text = os.environ.get("ROS_DOMAIN_ID", "")
    if text:
        if not text.isdecimal() or int(text) > LAST_DOMAIN:
            raise ParameterError(
                f"ROS_DOMAIN_ID is {text!r}, must be an integer from 0 to {LAST_DOMAIN}"
            )
        return int(text)
    # Which domain a run has changes nothing in its results: no seed is needed.
    for domain in random.sample(range(1, LAST_DOMAIN + 1), LAST_DOMAIN):
        if _is_free(domain):
            return domain
    raise ParameterError("every ROS domain is in use on this machine: give one by --domain-id")


def _is_free(domain: int) -> bool:
    # By the RTPS standard the first participant of a domain listens on this port.
    port = 7400 + 250 * domain + 10
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", port))
        except OSError:
            return False
    return True
