"""Short answers to the questions of new users, one Markdown file each."""
