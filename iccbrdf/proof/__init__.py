"""A print job -> proofs: colours in, the relief, lights and views, pictures for a display, and a log."""
