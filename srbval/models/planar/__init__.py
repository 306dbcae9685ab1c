"""Planar ring on kinematic rollers or balls: two free coordinates, contact stiffness varies as rollers pass.

Simulates spherical roller bearings with a [geometry], and other bearings with [elements]: balls in Hertzian point
contact, cylindrical rollers in line contact, see `contacts`.

Suitable for: harmonic pattern, load-zone modulation and sidebands, amplitude, roller passage (variable compliance) of a
healthy bearing. Not suitable for: slip (the cage turns kinematically, or lags by the scene's `cage_slip`), noise floor
(no rattling or chatter), axial load or motion, point passing, energy, roller dynamics. A ball's defect stays on its
track, and the contact angle does not change with the load. The axial force that a radial load causes in a tapered or
angular contact bearing is assumed to be carried elsewhere.
"""
