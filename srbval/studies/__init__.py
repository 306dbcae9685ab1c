"""Studies, one folder each, with their pages in the report; `harness` finds, runs and stores them.

A folder contains ``study.toml`` (a `harness.Study`: question and options), ``study.py`` (the function ``run``, which
answers the question), and for a page in the report ``texts.toml``, whose ``[page]`` lists the blocks, or ``page.py``
with a `report.pages.Page` named ``PAGE``. Nothing outside a folder imports it, so it can be deleted with its study.
"""
