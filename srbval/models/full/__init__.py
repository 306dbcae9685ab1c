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

Slot axes of a roller, unit vectors: x along the slot (outwards), y along the race in the direction of rolling, z along
the roller. Subscripts x, y, z are components in slot axes. L is the distance of the roller's centre from the bearing's
centre at zero slide, u the slide, w the cage's angular velocity, s the spin; F is the force of both races and gravity
on the roller, T the torque of both races, m, I_a and I_t its mass and moments of inertia about and across its axis; I_c
is the cage's inertia tensor, x x and z z are dyads. Newton-Euler equations projected on the generalised speeds (Kane &
Levinson 1985, Dynamics, ch. 6):

* slide: m u'' = m (L + u) (w_y^2 + w_z^2) + F_x
* spin: I_a s' = T_z; a roller is symmetric about its axis, so the motion of the cage does not enter
* cage with its rollers: (I_c + sum [m (L+u)^2 (1 - x x) + I_t (1 - z z)]) w' = sum Q - w x (I_c w), where each roller
  exerts on the cage the torque Q: Q_x = T_x - G w_y with G = I_a s - I_t w_z,
  Q_y = T_y + G w_x - (L+u) F_z + m (L+u)^2 w_x w_z - 2 m (L+u) u' w_y,
  Q_z = (L+u) F_y - m (L+u)^2 w_x w_y - 2 m (L+u) u' w_z
* outer ring with housing: (m_o + m_h) r'' = F_load - K_h r - C_h r' - sum F_o; r: displacement; m_o, m_h: masses;
  F_load: load and weight; K_h, C_h: spring and damper of the housing; F_o: force of the outer race on a roller
"""
