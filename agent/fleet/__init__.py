"""Many recordings, on one machine or many: a lake of files, one function over all of them."""
