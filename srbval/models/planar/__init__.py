"""A planar ring on kinematic rollers or balls: two free coordinates, contact stiffness varying as they pass.

Runs spherical roller bearings with a [geometry], and any other with [elements]: balls in Hertz's point contact,
cylindrical rollers in line contact, see `contacts`.

Answers: harmonic pattern, load-zone modulation and sidebands, amplitude, roller passage (variable compliance) of a
healthy bearing. Cannot answer: slip (its cage turns kinematically, or lags by the scene's `cage_slip`), noise floor
(nothing rattles or chatters), axial load or motion, point passing, energy, roller dynamics. A ball's defect stays on
its track, and the contact angle what it is under any load. Of a tapered or angular contact bearing the axial force that
a radial load makes is taken by something else.
"""
