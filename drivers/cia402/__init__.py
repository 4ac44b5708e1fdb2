"""CiA 402 drives over CANopen: words, states, PDO mapping, SDO access, the axis."""
