"""Planar ring model: the outer ring moves in x and y, on rollers or balls that turn as in pure rolling.

Simulates bearings whose file has a table `[geometry]` (spherical roller bearings) or `[elements]` (balls in Hertzian
point contact, cylindrical rollers in line contact), see `contacts`.

Suitable for: harmonics of BPFO, BPFI and BSF, sidebands by load-zone modulation, amplitude, roller passage (variable
compliance) of a healthy bearing. Not suitable for: slip (the cage only lags by the scene's constant `cage_slip`), noise
floor (no rattling or chatter), axial load or motion, energy, roller dynamics, and the vibration that rollers cause in
the full model by passing the points of which its races consist. A defect of a ball is assumed to stay on the ball's
running track. The contact angle does not change with the load. The axial force that a radial load causes in a tapered
or angular contact bearing is assumed to be carried by another bearing.
"""
