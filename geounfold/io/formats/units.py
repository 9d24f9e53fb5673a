"""Names of length units, which formats spell differently."""

from __future__ import annotations

_NAMES = {
    "m": ("m", "metre", "meter", "metres", "meters"),
    "km": ("km", "kilometre", "kilometer", "kilometres", "kilometers"),
    "cm": ("cm", "centimetre", "centimeter", "centimetres", "centimeters"),
    "mm": ("mm", "millimetre", "millimeter", "millimetres", "millimeters"),
    "ft": ("ft", "foot", "feet"),
    "in": ("in", "inch", "inches"),
    "us-ft": ("us-ft", "ussurveyfoot", "ussurveyfeet", "ftus"),
}


def unit_name(text: str) -> str:
    """Return a unit's short name; an unknown unit is returned unchanged.

    Examples
    --------
    >>> unit_name("Feet"), unit_name("rods")
    ('ft', 'rods')
    """
    plain = text.strip().lower().replace(" ", "").replace("_", "")
    return next((short for short, names in _NAMES.items() if plain in names), text.strip())
