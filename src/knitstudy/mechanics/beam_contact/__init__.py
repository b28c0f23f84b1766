"""Contact of beams of circular section: smooth centrelines, closest points, friction between the surfaces."""
