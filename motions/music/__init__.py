"""Music: the beats of a song, songs whose beats are known, and dances on them."""
