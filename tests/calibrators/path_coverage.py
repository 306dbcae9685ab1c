"""Bias and coverage of identified paths on simulated truth: ``python -m tests.calibrators.path_coverage [--rigs N]``.

Rigs of one known path, each with pulses, slip and noise of its own, through `identify`; the path's level in third
octaves against the true one and its 95 % interval, by Student's factor for what the bands leave over. A rig's third
octaves share its errors, so that the count's own standard error is taken over rigs.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.special import stdtrit

from srbval.validation.identify import identify
from tests.calibrators.rows import print_rows
from tests.validation.simulated_rig import BEARING, TRUE, simulated_rig

THIRD_OCTAVES_HZ = 10 ** (np.arange(27, 35) / 10)  # 500 to 2500 Hz, wholly within the band of the fit


def main() -> None:
    """Run them and print a row per third octave."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rigs", type=int, default=100)
    parser.add_argument("--first-seed", type=int, default=3000)
    parser.add_argument("--noise", type=float, default=0.05)
    parser.add_argument("--missed-db", type=float, default=1.5)
    options = parser.parse_args()
    errors, inside, modes = [], [], []
    truth, _ = TRUE.level_db(THIRD_OCTAVES_HZ)
    for seed in range(options.first_seed, options.first_seed + options.rigs):
        rig = simulated_rig(seed, noise=options.noise, missed_db=options.missed_db)
        found = identify(rig.fault, rig.healthy, rig.excitation, bearing=BEARING)
        level, u = found.path.level_db(THIRD_OCTAVES_HZ)
        assert found.levels_db is not None
        spare = len(found.levels_db) - 2 - 3 * len(found.path.modes)
        errors.append(level - truth)
        inside.append(np.abs(level - truth) <= stdtrit(spare, 0.975) * u)
        modes.append(len(found.path.modes))
    columns = zip(
        THIRD_OCTAVES_HZ, np.mean(errors, axis=0), np.std(errors, axis=0), np.mean(inside, axis=0), strict=True
    )
    print_rows([{"hz": hz, "bias_db": b, "scatter_db": s, "covered": c} for hz, b, s, c in columns])
    share = np.mean(inside, axis=1)
    u = np.std(share, ddof=1) / np.sqrt(len(share))
    print(f"all: bias {np.mean(errors):+.2f} dB, covered {share.mean():.3f} +- {u:.3f}; "
          f"modes {np.bincount(modes).tolist()}")  # fmt: skip


if __name__ == "__main__":
    main()
