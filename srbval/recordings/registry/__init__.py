"""The user's register of recordings: which files there are, what they contain, if they changed."""

from srbval.recordings.registry.lookup import (
    find_recording,
    healthy_baseline,
    load_entry,
    load_registered,
    registered_settings,
    rig_of,
    rig_recordings,
    unopened,
)
from srbval.recordings.registry.manifest import FileStatus, RegisteredRecording, without_copies
from srbval.recordings.registry.register import (
    RIG_EXCERPTS,
    RegisterListing,
    add,
    fetch,
    files_under,
    listing,
    remove,
    verify,
)
