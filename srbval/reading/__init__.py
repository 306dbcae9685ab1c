"""From a recording to its lines: band, envelope, spectrum, shaft speed, fault lines with intervals."""
