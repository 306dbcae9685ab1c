"""Studies that srbval carries, one folder each, with their pages in the report; `harness` finds, runs and stores them.

A folder, which needs no ``__init__``, holds ``study.toml`` (a `harness.Study`: the question, its options), ``study.py``
(the function ``run`` that answers it), and where the report shows it ``texts.toml``, whose ``[page]`` lists the blocks,
or ``page.py`` with a `report.pages.Page` named ``PAGE`` that makes them. Nothing outside of a folder imports it:
deleting it removes the study and its page, and nothing else.
"""
