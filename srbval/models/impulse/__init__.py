"""Force pulses at the passages of a defect, with random slip, load-zone modulation and one resonance.

McFadden & Smith (1984, J. Sound Vib. 96, 69: the paper's ref. 54) with slip as a process of stationary increments
(Antoni & Randall 2003, J. Vib. Acoust. 125, 282). Each pulse has the length and height that the defect has under a
roller at that angle of the load zone (see `srbval.models.planar.statics`); the ring answers as a mass on housing and
contacts linearised about static balance. Of a bearing without geometry only the places of the lines are right: see
`plain`.

Answers: where the lines are, harmonic pattern, sidebands and load-zone modulation, roughly the amplitude. Cannot
answer: slip of the cage (its mean is none), noise floor, the healthy bearing (it is silent), anything that a moving
ring does to the pulses, axial load.
"""
