"""Defects that the slices model refuses; what it takes from scene and bearing: `tests/verification/test_slices_*`."""

from typing import Any

import pytest

from srbval.bearing import load_bearing
from srbval.errors import ConfigurationError
from srbval.models.slices import slice_parameters
from srbval.scene import paper_scene

HOLE = {"kind": "outer", "shape": "hole", "extent": "2 mm", "height": "-0.5 mm"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"defect": {"kind": "outer", "shape": "cosine", "extent": "2 mm"}}, "cosine"),
        ({"defect": HOLE | {"axial": "25 mm"}}, "beside the roller"),
        ({"defect": HOLE, "further_defects": [HOLE | {"angle": "0.2 deg"}]}, "a roller meets both"),
        ({"defect": HOLE | {"kind": "roller"}, "further_defects": [HOLE | {"kind": "roller"}]}, "two defects"),
    ],
)
def test_what_slices_cannot_tell_apart_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        slice_parameters(paper_scene(**changes), load_bearing("skf-22240").geometry)
