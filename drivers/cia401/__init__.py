"""CiA 401 inputs on CAN: a contact that says whether the cell is released."""
