from srbval.bench.chain_errors import BANDS_HZ, chain_errors

LARGEST = 1e-4  # of the largest squared envelope


def test_one_pass_is_the_truth_and_the_papers_chain_where_that_is_too():
    rows = chain_errors(102_400)
    assert [(row.low_hz, row.high_hz) for row in rows] == list(BANDS_HZ)
    for row in rows:
        assert row.one_pass < LARGEST
        assert row.papers_chain_faded < LARGEST
        assert row.one_pass_less_faded < LARGEST
        # What the chain as it stands differs by is its own error.
        assert row.papers_chain > row.one_pass
        assert row.one_pass_less_chain <= row.papers_chain + row.one_pass
