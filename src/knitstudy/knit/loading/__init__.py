"""A model along its load path: prescribed motion, increments, history, restart. Knows neither solids nor beams."""
