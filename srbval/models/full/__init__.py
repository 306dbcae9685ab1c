"""Full model: 38 barrel rollers, cage and outer ring; raceways are point clouds (Giraudo et al. 2025, sect. 2).

82 free coordinates, and the prescribed shaft angle. World axes: z along the shaft, y up. A slot is a roller's place in
the cage, in which the roller slides in and out. State vector for N rollers (row 1 first, then row 2):

==================  ===================================================
``y[0:N]``          slide of each roller along its slot [m]
``y[N:2N]``         angle of each roller about its own axis, relative to its slot [rad]
``y[2N:2N+3]``      cage gimbal angles about x, y, z [rad]
``y[2N+3:2N+6]``    outer ring displacement x, y, z [m]
``y[D:D+N]``        slide velocities [m/s], D = 2N + 6
``y[D+N:D+2N]``     absolute spins about the rollers' own axes [rad/s]
``y[D+2N:D+2N+3]``  cage angular velocity in world axes [rad/s]
``y[D+2N+3:]``      outer ring velocity [m/s]
==================  ===================================================

With a cage for each row, D = 2N + 7: coordinates and velocities each end with one more entry, the angle by which row
2's cage is ahead of row 1's about their common axis [rad], and its rate [rad/s]; see `second_cage_kernel`.

Equations, and the slot axes of a roller in which kernels state vectors: page "Equations of motion" of the theory.
"""
