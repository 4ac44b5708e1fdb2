"""Commands of the shop-floor page: serve it, its users, the processes that it starts."""
