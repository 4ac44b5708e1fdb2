"""Commands about months: monitor, watch, ordinary, schedule, self-test, made-up histories."""
