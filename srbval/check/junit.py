"""A check as a JUnit report, the form that build servers read."""

from pathlib import Path
from xml.etree import ElementTree

from srbval.check.check import CheckResult
from srbval.storage.whole_file import whole_file


def write_junit(path: Path, result: CheckResult, *, seconds: float) -> None:
    """Write one test case per quantity, with a failure's values as its message; `DataError` where that cannot be."""
    failed = sum(not check.ok for check in result.checks)
    counts = {"tests": len(result.checks) + len(result.skipped), "failures": failed, "skipped": len(result.skipped)}
    suite = ElementTree.Element("testsuite", {"name": "srbval check", "errors": "0", "time": f"{seconds:.1f}"})
    suite.attrib |= {key: str(count) for key, count in counts.items()}
    for check in result.checks:
        case = ElementTree.SubElement(suite, "testcase", {"classname": "srbval.check", "name": check.name})
        if not check.ok:
            message = f"{check.value:.9g} is not within {check.low:.9g} to {check.high:.9g} {check.unit}"
            ElementTree.SubElement(case, "failure", {"message": message}).text = check.reason
    for name in result.skipped:
        case = ElementTree.SubElement(suite, "testcase", {"classname": "srbval.check", "name": name})
        ElementTree.SubElement(case, "skipped", {"message": "needs a recording that is not registered"})
    suites = ElementTree.Element("testsuites")
    suites.append(suite)
    ElementTree.indent(suites)
    with whole_file(path) as part:
        ElementTree.ElementTree(suites).write(part, encoding="utf-8", xml_declaration=True)
