"""What is kept and read back: finished cells, results files, and what they may hold."""
