"""report.json is strict JSON and carries what the pages show."""

from srbval.report.write import report_data


def test_figures_are_listed_from_the_tree(report):
    data = report_data(report)
    assert [f["id"] for f in data["figures"]] == ["fig11b", "fig12a"]
    assert data["figures"][0]["file"] == "figures/fig11b.svg"
    assert data["figures"][0]["data"] == "figures/fig11b.csv"
    assert data["figures"][0]["synthetic"] is True
