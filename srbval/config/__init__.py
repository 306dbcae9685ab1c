"""Reading configuration: units at the border, strict TOML into frozen dataclasses."""
