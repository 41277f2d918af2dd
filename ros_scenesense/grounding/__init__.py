"""Gives spatial prepositions their meaning in point clouds, and settles what to pass on."""
