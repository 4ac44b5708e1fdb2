"""What every estimator starts from: signals filtered alike, their gaps, their steady windows."""
