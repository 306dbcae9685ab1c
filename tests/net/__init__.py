"""The net: records what a checkout of srbval does, and compares any other checkout with that record.

    export SRBVAL_RECORDINGS=FOLDER_OF_RECORDINGS
    python -m tests.net record -o FOLDER --checkout OLD
    python -m tests.net compare FOLDER --checkout NEW
    python -m tests.net speed OLD NEW

It knows srbval by its command line alone, run in child processes, and by the files that it writes; so it outlives every
change of modules and names. What changes on purpose is listed in ``allowed_changes.toml``, with the reason.
"""
