"""SceneSense: commonsense reasoning and knowledge acquisition that guide deep learning on ROS 2."""

__version__ = "0.1.0"
