import numpy as np
import pytest

from srbval.signal import analytic_signal, bandpass, envelope
from srbval.studies.reading_accuracy.signal_chain import AGREEMENT, BANDS_HZ, FS_HZ, chain_errors

LARGEST = 1e-4  # of the largest squared envelope
SAMPLES = 102_400


@pytest.fixture(scope="module")
def rows():
    return chain_errors(SAMPLES, records=2)


def test_one_pass_is_the_truth_and_the_papers_chain_where_that_is_too(rows):
    assert [(row.low_hz, row.high_hz) for row in rows] == list(BANDS_HZ)
    for row in rows:
        assert row.one_pass < LARGEST
        assert row.papers_chain_faded < LARGEST
        assert row.one_pass_less_faded < LARGEST
        # What the chain as it stands differs by is its own error.
        assert row.papers_chain > row.one_pass
        assert row.one_pass_less_chain <= row.papers_chain + row.one_pass


def test_the_worst_of_several_records_is_told(rows):
    for row, one in zip(rows, chain_errors(SAMPLES, records=1), strict=True):
        assert row.records == 2
        assert row.one_pass_less_chain >= one.one_pass_less_chain
        assert row.agree_beyond_s >= one.agree_beyond_s


def test_further_from_the_ends_than_told_the_two_agree():
    (row, _) = chain_errors(SAMPLES, records=1)
    record = np.random.default_rng(0).standard_normal(3 * SAMPLES)[SAMPLES : 2 * SAMPLES]
    chain = envelope(bandpass(record, FS_HZ, BANDS_HZ[0]))
    apart = np.abs(np.abs(analytic_signal(record, FS_HZ, BANDS_HZ[0])) - chain)
    far = round(row.agree_beyond_s * FS_HZ) + 1
    largest = chain[1024:-1024].max()  # 50 ms
    assert apart[far:-far].max() <= AGREEMENT * largest < apart[far - 1 : SAMPLES - far + 1].max()


def test_what_is_taken_from_it_differs_less_than_the_envelope_itself_does(rows):
    for row in rows:
        assert row.envelope_rms_less_chain < row.envelope_less_chain < row.one_pass_less_chain * 10
        assert 0 < row.lines_less_chain < row.one_pass_less_chain
        assert 0 < row.fault_line_less_chain < LARGEST
