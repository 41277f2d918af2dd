"""The frame in which left, right, front, behind, above and below are named.

Naming relations along the tilted axes of the camera calls what lies behind "above". The default
is therefore a gravity-up frame of the viewer: up is the normal of the table, away from the viewer
is the camera's axis projected onto the table, and right completes the two.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ros_scenesense.geometry import Float, Pose, rotation_matrix
from ros_scenesense.scene import NamingFrame

GRAVITY = "gravity"
CAMERA = "camera"

_LARGEST_DISAGREEMENT_DEG = 20.0
_LARGEST_ROLL_DEG = 45.0


@dataclass(frozen=True, eq=False)
class NamingAxes:
    """The axes along which relations are named.

    Attributes:
        name: What the frame is called in messages.
        rows: (3, 3), its rows are right, away and up as unit vectors in the camera optical frame;
            `points @ rows.T` turns points from the optical frame.
    """

    name: NamingFrame
    rows: Float

    def turned(self, yaw_rad: float) -> NamingAxes:
        """These axes turned about up, to the left: from the viewer's to those of people.

        The camera's own axes are turned about the image's up.
        """
        if yaw_rad == 0.0:
            return self
        cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
        turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        name = NamingFrame.ROBOT if self.name is NamingFrame.VIEWER else self.name
        return NamingAxes(name, turn @ self.rows)


def camera_axes() -> NamingAxes:
    """The optical axes themselves: right is x, away is z, up is -y."""
    return NamingAxes(NamingFrame.CAMERA, np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]]))


def gravity_axes(up: Float) -> NamingAxes:
    """The viewer's gravity-up axes.

    Args:
        up: (3,) direction against gravity in the camera optical frame, of any length.
    """
    up = np.asarray(up, dtype=np.float64) / np.linalg.norm(up)
    optical_axis, image_up = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])
    away = optical_axis - (optical_axis @ up) * up
    if np.linalg.norm(away) < 1e-3:  # looking straight down, away is where the image's top is
        away = image_up - (image_up @ up) * up
    away /= np.linalg.norm(away)
    return NamingAxes(NamingFrame.VIEWER, np.stack([np.cross(away, up), away, up]))


def yaw_to_robot(axes: NamingAxes, camera_pose: Pose) -> float:
    """By how much (radians) the viewer's axes must be turned to the left to be the robot's.

    Args:
        axes: The viewer's.
        camera_pose: Pose of the optical frame in the world, whose x is ahead of the robot.
    """
    right = -rotation_matrix(camera_pose.orientation)[1]  # of the robot, in the optical frame
    return float(np.arctan2(axes.rows[1] @ right, axes.rows[0] @ right))


def choose_axes(
    frame: str, table_normal: Float | None, camera_pose: Pose | None
) -> tuple[NamingAxes, str | None]:
    """The naming axes for an image, from the best knowledge of gravity that there is.

    Args:
        frame: `gravity` or `camera`.
        table_normal: (3,) unit normal of the table in the optical frame; None if not found.
        camera_pose: Pose of the optical frame in the gravity-up world; None if unknown.

    Returns:
        The axes, and what was wrong if they are second choice.
    """
    if frame == CAMERA:
        return camera_axes(), None
    known_up = None if camera_pose is None else rotation_matrix(camera_pose.orientation)[2]
    wrong = _why_no_table(table_normal, known_up)
    if table_normal is not None and wrong is None:
        return gravity_axes(table_normal), None
    if known_up is not None:
        return gravity_axes(known_up), f"{wrong}: the direction of gravity is the camera pose's"
    return camera_axes(), (
        f"{wrong}, and the camera pose is unknown: relations are named along the camera's own "
        "axes; show more of the table or publish camera_pose in scene"
    )


def _why_no_table(normal: Float | None, known_up: Float | None) -> str | None:
    """What speaks against the plane being a table; None if nothing does."""
    if normal is None:
        return "no table plane is in the depth image"
    if known_up is not None:
        angle = np.degrees(np.arccos(np.clip(normal @ known_up, -1.0, 1.0)))
        if angle > _LARGEST_DISAGREEMENT_DEG:
            return f"the largest plane is tilted by {angle:.0f} degrees and cannot be a table"
        return None
    # The camera looks at a table with its image more or less upright.
    limit = np.sin(np.radians(_LARGEST_ROLL_DEG))
    if abs(normal[0]) > limit or normal[1] > limit:
        return "the largest plane faces sideways or down and cannot be a table"
    return None
