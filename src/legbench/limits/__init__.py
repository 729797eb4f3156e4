"""Safety limits of a leg, enforced in the lowest layer of every plant; pure."""
