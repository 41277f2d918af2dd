"""The simulated world: objects, arrangements, physics, camera, and the truth about a scene."""
