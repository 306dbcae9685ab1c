"""The full model with continuous contacts: each circle of a race meets a roller in a patch, not in points.

Same bodies, joints, load and solvers; only the contact differs. With K_c / s held and the points dense (see
`srbval.models.patch`) a circle's normal force at a penetration d is K_c/s (4/3) sqrt(2/kappa) d^(3/2), its damper
2 C_c/s sqrt(2 d/kappa), its elastic energy 2/5 F d. The depth rate is that in the patch's middle: elsewhere along it
rolling adds as much as it takes. Slip is not one over the patch: at xi = x over its half length the penetration is
d (1 - xi^2), and a race that turns by W against a roller of radius rho slips W d (1 + 1/(kappa rho)) xi^2 faster than
in the middle, by some 20 mm/s at the edge; and turning about the tilted normal it slips across, by some 10 mm/s at
either end. Both are far above the critical velocity. So the patch is taken in three parts of equal load, each with its
mean slip, and eq. (19) averaged over the slips in it; a patch held in one piece would stick and bind the rings
tangentially as no row of points does. Left out: the couples by which dampers resist rolling and friction resists
pivoting, with the power both take, and what leans with the normal along a patch.

Near a race's defect a roller meets points again, `DENSER` times as many as the scene says with as much less of K_c and
C_c each: there a raised piece covers only its own length of the patch.

Without points passing by, three of the full model's steps may be taken in one: cage speed to 1e-7, 500-1500 Hz to 1 %.

Answers: all questions, without the excitation by points passing. Cannot answer: point passing itself; defects on
rollers.
"""
