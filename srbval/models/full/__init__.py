"""The full model: 38 rollers, cage and outer ring, point clouds against barrel rollers (Giraudo et al. 2025, sect. 2).

82 free coordinates and one driven. State vector, for N rollers (row 1 first, then row 2):

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

With a cage for each row, either half has one more at its end, D = 2N + 7: by how much row 2's cage is ahead of row 1's
about their common axis [rad], and its rate [rad/s]; see `second_cage_kernel`.

Slot axes of a roller: x along the slot (outwards, tilted by alpha), y along the race, z along the roller. With the
slide u, L = d_p / cos(alpha), the cage's angular velocity w, the spin s, force F and torque T of both races on the
roller, Newton-Euler projected on the generalised speeds (Kane & Levinson, Dynamics: Theory and Applications, 1985,
ch. 6):

* slide: m u'' = m (L + u) (w_y^2 + w_z^2) + F_x
* spin: I_a s' = T_z; the roller is a symmetric top, so neither the cage nor the tilt enters
* cage with its rollers: (I_c + sum [m (L+u)^2 (1 - x x) + I_t (1 - z z)]) w' = - w x (I_c w) + the sum of, in slot
  axes, x: T_x - G w_y; y: T_y + G w_x - (L+u) F_z + m (L+u)^2 w_x w_z - 2 m (L+u) u' w_y;
  z: (L+u) F_y - m (L+u)^2 w_x w_y - 2 m (L+u) u' w_z; with G = I_a s - I_t w_z
* outer ring: (m_o + m_h) v' = F_load - K_h r - C_h v - the sum of the outer race's F
"""
