"""Writers and readers of file layouts."""
