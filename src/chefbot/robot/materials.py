"""Densities and colours of the materials that parts are made of."""

from __future__ import annotations

from typing import NamedTuple

RgbaColour = tuple[float, float, float, float]


class Material(NamedTuple):
    """Density in kg/m^3 and colour as red, green, blue, alpha in 0..1."""

    density: float
    colour: RgbaColour


MATERIALS = {
    "acrylic": Material(1190.0, (0.75, 0.85, 0.92, 0.55)),
    "aluminium": Material(2700.0, (0.72, 0.73, 0.76, 1.0)),
    "brass": Material(8500.0, (0.78, 0.65, 0.30, 1.0)),
    "mdf": Material(750.0, (0.64, 0.50, 0.36, 1.0)),
    "nylon": Material(1140.0, (0.93, 0.92, 0.87, 1.0)),
    "petg": Material(1270.0, (0.30, 0.33, 0.38, 1.0)),
    "pla": Material(1240.0, (0.30, 0.33, 0.38, 1.0)),
    "plywood": Material(680.0, (0.85, 0.70, 0.45, 1.0)),
    "steel": Material(7850.0, (0.55, 0.56, 0.58, 1.0)),
}
"""Handbook densities (Ashby, Materials Selection in Mechanical Design, appendix A); plywood is birch."""
