"""Runs the launcher: `python -m ros_scenesense.launcher`."""

import sys

from ros_scenesense.launcher import main

if __name__ == "__main__":
    sys.exit(main())
