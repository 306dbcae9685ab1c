"""Kernel: Runge-Kutta steps of a ring in its plane, pushed by rollers at prescribed angles."""

from __future__ import annotations

import math

from srbval.models.jit import kernel

STATE = 4  # displacement x, y [m], velocity x, y [m/s]


@kernel
def push(
    ring_x, ring_y, speed_x, speed_y, cage, shaft, spun, rollers, plain, plain_start, plain_step,
    defects, bumps, bump_start, bump_step, found,
):  # fmt: skip
    """Force of all rollers on the ring, x and y [N], and the deepest penetration [m], into `found`.

    Both rows stand at the same angles and press alike; a defect adds to one roller's force. `cage`, `shaft` angles,
    `spun` that of the rollers against their slots. `defects`, [D, 6]: kind (0 on the outer race, 1 on the inner, 2 on a
    roller against the outer, 3 against the inner), angle [rad], roller's number, race radius [m], spacing of the places
    in its table [m], roller radius [m]. `bumps`, [D, approach, places].
    """
    force_x, force_y, deepest = 0.0, 0.0, -1.0
    last, bump_last, places = plain.shape[1] - 2, bumps.shape[1] - 2, bumps.shape[2] - 1
    pi2 = 2.0 * math.pi
    for i in range(rollers):
        angle = cage + pi2 * i / rollers
        c, s = math.cos(angle), math.sin(angle)
        approach = -(ring_x * c + ring_y * s)
        at = (approach - plain_start) / plain_step
        at = min(max(at, 0.0), last + 0.999)
        k = int(at)
        w = at - k
        depth = (1.0 - w) * plain[2, k] + w * plain[2, k + 1]
        deepest = max(deepest, depth)
        force = (1.0 - w) * plain[0, k] + w * plain[0, k + 1]
        damper = (1.0 - w) * plain[1, k] + w * plain[1, k + 1]
        force -= damper * (speed_x * c + speed_y * s)
        force = 2.0 * max(force, 0.0)
        for j in range(defects.shape[0]):
            kind = int(defects[j, 0])
            if kind < 2:
                away = angle - defects[j, 1] - (shaft if kind == 1 else 0.0)
                arm = defects[j, 3]
            elif int(defects[j, 2]) == i:
                away = spun + defects[j, 1] - (math.pi if kind == 3 else 0.0)
                arm = defects[j, 5]
            else:
                continue
            away -= pi2 * math.floor(away / pi2 + 0.5)
            place = abs(away) * arm / defects[j, 4]
            if place >= places:
                continue
            at = (approach - bump_start) / bump_step
            at = min(max(at, 0.0), bump_last + 0.999)
            k, m = int(at), int(place)
            w, v = at - k, place - m
            force += (1.0 - w) * ((1.0 - v) * bumps[j, k, m] + v * bumps[j, k, m + 1])
            force += w * ((1.0 - v) * bumps[j, k + 1, m] + v * bumps[j, k + 1, m + 1])
        force_x += force * c
        force_y += force * s
    found[0], found[1], found[2] = force_x, force_y, deepest


@kernel
def advance_ring(
    y, cage, shaft, spun, radial, step, mass, stiffness, damping, direction_x, direction_y, weight, rollers,
    plain, plain_start, plain_step, defects, bumps, bump_start, bump_step, per_output, out,
    rate, trial, found,
):  # fmt: skip
    """Advance `y` in place, classical Runge-Kutta, over ``out.shape[0]`` output intervals of `per_output` steps.

    `cage`, `shaft`, `spun`, `radial`: angles [rad] and load [N] at every half step, [2 n + 1]. Columns of `out`: see
    `srbval.models.simulate.signals`; 0-1, 3-4, 9-10, 12 are filled.
    `rate`, [4, STATE], `trial`, [STATE], and `found`, [3]: working space.
    """
    interval = step * per_output
    half = 0
    for i in range(out.shape[0]):
        before_x, before_y = y[2], y[3]
        sum_x, sum_y, deepest = 0.0, 0.0, -1.0
        for _ in range(per_output):
            for stage in range(4):
                place = half + (stage + 1) // 2
                reach = step * (0.0 if stage == 0 else (1.0 if stage == 3 else 0.5))
                for k in range(STATE):
                    trial[k] = y[k] + (reach * rate[stage - 1, k] if stage > 0 else 0.0)
                push(
                    trial[0], trial[1], trial[2], trial[3], cage[place], shaft[place], spun[place], rollers, plain,
                    plain_start, plain_step, defects, bumps, bump_start, bump_step, found,
                )  # fmt: skip
                rate[stage, 0], rate[stage, 1] = trial[2], trial[3]
                load_x, load_y = radial[place] * direction_x, radial[place] * direction_y + weight
                rate[stage, 2] = (load_x + found[0] - stiffness * trial[0] - damping * trial[2]) / mass
                rate[stage, 3] = (load_y + found[1] - stiffness * trial[1] - damping * trial[3]) / mass
                share = 1.0 / 6.0 if stage == 0 or stage == 3 else 1.0 / 3.0
                sum_x += share * found[0]
                sum_y += share * found[1]
                deepest = max(deepest, found[2])
            for k in range(STATE):
                y[k] += step / 6.0 * (rate[0, k] + 2.0 * rate[1, k] + 2.0 * rate[2, k] + rate[3, k])
            half += 2
        out[i, 0] = (y[2] - before_x) / interval
        out[i, 1] = (y[3] - before_y) / interval
        out[i, 3], out[i, 4] = y[0], y[1]
        out[i, 9], out[i, 10] = sum_x / per_output, sum_y / per_output
        out[i, 12] = deepest
