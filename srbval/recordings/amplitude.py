"""Units of vibration samples."""

from __future__ import annotations

STANDARD_GRAVITY_M_S2 = 9.80665

# spelling in files and options -> unit of the stored samples and factor to it
UNITS: dict[str, tuple[str, float]] = {
    "m/s2": ("m/s2", 1.0),
    "m/s^2": ("m/s2", 1.0),
    "m/s²": ("m/s2", 1.0),
    "m s-2": ("m/s2", 1.0),
    "mm/s2": ("m/s2", 1e-3),
    "g": ("m/s2", STANDARD_GRAVITY_M_S2),
    "mg": ("m/s2", STANDARD_GRAVITY_M_S2 * 1e-3),
    "V": ("V", 1.0),
    "mV": ("V", 1e-3),
    "unknown": ("unknown", 1.0),
}
