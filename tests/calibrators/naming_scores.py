"""Are the probabilities of naming a fault right? ``python -m tests.calibrators.naming_scores`` prints what it says."""

from __future__ import annotations

from srbval.bench.naming_scores import naming_scores
from tests.calibrators.rows import print_rows


def main() -> None:
    """Judge and print."""
    found = naming_scores()
    for rows in (found["calls"], [found["scores"]], [found["wrongly_read"]], found["reliability"]):
        print_rows(rows)


if __name__ == "__main__":
    main()
