"""The page without a browser: routes, roles, attacks, the running cycle's files."""
