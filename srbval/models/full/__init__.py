"""The full model: 38 rollers, cage and outer ring, point clouds against barrel rollers (Giraudo et al. 2025).

82 free coordinates and one driven. State vector, for N rollers (row 1 first, then row 2):

=================  ====================================================
``y[0:N]``         slide of each roller along its slot [m]
``y[N:2N]``        angle of each roller about its own axis [rad]
``y[2N:2N+3]``     cage gimbal angles about x, y, z [rad]
``y[2N+3:2N+6]``   outer ring displacement x, y, z [m]
``y[D:D+N]``       slide velocities [m/s], D = 2N + 6
``y[D+N:D+2N]``    absolute spins about the rollers' own axes [rad/s]
``y[D+2N:D+2N+3]`` cage angular velocity in world axes [rad/s]
``y[D+2N+3:]``     outer ring velocity [m/s]
=================  ====================================================
"""
