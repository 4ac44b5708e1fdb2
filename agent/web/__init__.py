"""The shop-floor page: what a technician sees and presses, and who may.

Its process never touches a bus. A cycle is a child process with the existing lock, preconditions
and clean-up; the page starts it, reads the stream that it writes, and asks it to stop. What
identifies, plans or drives does not live here.
"""
