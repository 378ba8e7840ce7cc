"""What a campaign's table says: requirements met or not, laws compared, what drives an error."""
