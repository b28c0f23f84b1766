"""Contact of surfaces: search, projection, quadrature, friction, and its tangent. Nothing of beams."""
