"""The objects that scenes are made of: four shapes in three sizes, at true scale.

The names of the attributes are the paper's (section *Reasoning and Learning Architecture*,
example of the Robot Assistant domain): size, surface, shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from ros_scenesense.scene import Size, Surface


class Shape(StrEnum):
    """Shapes of the catalogue."""

    CUBE = "cube"
    CYLINDER = "cylinder"
    SPHERE = "sphere"
    DUCK = "duck"


class Color(StrEnum):
    """Colours; each occurs once in a scene, so that `<colour>_<shape>` names one object."""

    RED = "red"
    GREEN = "green"
    BLUE = "blue"
    YELLOW = "yellow"
    WHITE = "white"


@dataclass(frozen=True)
class CatalogueItem:
    """An object before it has a colour and a place.

    Attributes:
        shape: Its shape.
        size: Its size class.
    """

    shape: Shape
    size: Size

    @property
    def surface(self) -> Surface:
        """Flat if and only if a centred cube put on it stays there."""
        return Surface.FLAT if self.shape in _FLAT else Surface.IRREGULAR

    @property
    def width_m(self) -> float:
        """Edge of the cube, diameter of cylinder and sphere; a duck is a fifth longer."""
        return _WIDTH_M[self.size]

    @property
    def height_m(self) -> float:
        """Height when it stands upright."""
        return self.width_m * _HEIGHT[self.shape]

    @property
    def radius_m(self) -> float:
        """Radius of the upright circle about the centre of mass that holds its footprint."""
        return self.width_m * _RADIUS[self.shape]

    @property
    def mass_kg(self) -> float:
        """Mass, of wood-like density."""
        return _DENSITY_KG_M3 * _VOLUME[self.shape] * self.width_m**3


_FLAT = (Shape.CUBE, Shape.CYLINDER)
_WIDTH_M = {Size.SMALL: 0.05, Size.MEDIUM: 0.075, Size.LARGE: 0.10}
_DENSITY_KG_M3 = 450.0

# In widths. The duck's are measured on its mesh, scaled to a length of 1.2 widths.
_HEIGHT = {Shape.CUBE: 1.0, Shape.CYLINDER: 1.2, Shape.SPHERE: 1.0, Shape.DUCK: 1.122}
_RADIUS = {Shape.CUBE: 0.7072, Shape.CYLINDER: 0.5, Shape.SPHERE: 0.5, Shape.DUCK: 0.622}
_VOLUME = {Shape.CUBE: 1.0, Shape.CYLINDER: 0.942, Shape.SPHERE: 0.524, Shape.DUCK: 0.478}

CATALOGUE = tuple(CatalogueItem(shape, size) for shape in Shape for size in Size)
"""Every object there is."""
