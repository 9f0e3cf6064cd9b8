"""From flat pieces around a body to a worn garment, without a penetration at any step."""
