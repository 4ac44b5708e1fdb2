"""Modbus TCP and RTU: register maps as data, one client, and the devices behind them."""
