"""Linear and nonlinear modes of an elastic leg, and return maps of its hops."""
