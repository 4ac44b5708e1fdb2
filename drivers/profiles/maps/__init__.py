"""Register maps of Modbus devices, one TOML file each; `drivers.modbus.register_map` reads them."""
