"""Studies, one folder each, with their pages in the report; `harness` finds and runs them and stores the results.

A folder contains ``study.toml`` (a `harness.Study`: question and options), ``study.py`` (the function ``run``, which
answers the question), and for a page in the report ``page.py`` with a `report.pages.Page` named ``PAGE``, and its texts
``texts.md``. No code outside imports from it, so a study is removed by deleting its folder.
"""
