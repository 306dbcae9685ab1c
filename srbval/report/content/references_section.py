"""The references that this report uses; those of recordings only where such recordings took part."""

from __future__ import annotations

from srbval.evidence.gather import Evidence
from srbval.recordings.datasets.description import dataset
from srbval.report.blocks import Listing
from srbval.report.inline import literal
from srbval.report.model import Section

ALWAYS = (
    "**Paper, model and published values**: Giraudo, Di Maggio, Giorio, Delprete: Dynamic Multibody Modeling of "
    "Spherical Roller Bearings with Localized Defects for Large-Scale Rotating Machinery. Sensors 25, 2419 (2025). "
    "doi 10.3390/s25082419",
    "**Verdicts**: ASME V&V 20-2009: Standard for Verification and Validation in Computational Fluid Dynamics and "
    "Heat Transfer",
    "**Envelope analysis**: Randall, Antoni: Rolling element bearing diagnostics - A tutorial. Mechanical Systems and "
    "Signal Processing 25 (2011) 485-520. doi 10.1016/j.ymssp.2010.07.017",
    "**Two-stage integrators**: Verwer, Spee, Blom, Hundsdorfer: A second-order Rosenbrock method applied to "
    "photochemical dispersion problems. SIAM J. Sci. Comput. 20 (1999) 1456-1480. doi 10.1137/S1064827597326651",
    "**Colours**: Okabe, Ito: Color universal design (2008)",
)


def references_section(evidence: Evidence) -> Section:
    """Papers first, then the data sets of the recordings that were read."""
    names = [*(e.dataset for e in evidence.registered), *(r.dataset for r in evidence.other_rigs)]
    sets = [dataset(n) for n in dict.fromkeys(n for n in names if n)]
    told = tuple(f"**Recordings**: {literal(d.title)}. {literal(d.source)}. {literal(d.url)}" for d in sets)
    return Section(id="references", title="References used", blocks=(Listing(items=(*ALWAYS, *told)),))
