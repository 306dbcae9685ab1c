"""False alarms of naming a fault are counted on records that hold none."""

from srbval.studies.naming_alarms.study import alarms, white


def test_alarms_on_noise_are_counted() -> None:
    found = alarms(white, 2)
    assert (found["records"], found["chances"], found["fault called"]) == (2, 6, 0)
