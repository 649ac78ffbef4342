"""What all mechanisms share; imports no mechanism."""
