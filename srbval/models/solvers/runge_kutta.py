"""Explicit Runge-Kutta methods of fixed step: the paper's ODE4 and the lower orders it rules out.

Names follow the paper's simulation software: ode1 Euler, ode2 Heun, ode3 Bogacki & Shampine (1989), ode4 the
classical method (Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, 1993, sect. II.1).
On the negative real axis they are stable to 2, 2, 2.51 and 2.79 over the largest rate. The full model's
friction relaxes some 300 times faster than ode4 resolves at 1/61440 s: it chatters, bounded, instead of
diverging, and the chatter is broadband noise in the acceleration. No step control, no implicit part.
"""

from srbval.models.solvers.method import explicit

ODE1 = explicit("ode1", "Euler", 1, [], [1.0])
ODE2 = explicit("ode2", "Heun", 2, [[1.0]], [0.5, 0.5])
ODE3 = explicit("ode3", "Bogacki-Shampine", 3, [[0.5], [0.0, 0.75]], [2 / 9, 3 / 9, 4 / 9])
ODE4 = explicit("ode4", "classical Runge-Kutta", 4, [[0.5], [0.0, 0.5], [0.0, 0.0, 1.0]], [1 / 6, 2 / 6, 2 / 6, 1 / 6])
