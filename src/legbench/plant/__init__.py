"""Plants, which are legs to control: one interface, one class in each file."""
