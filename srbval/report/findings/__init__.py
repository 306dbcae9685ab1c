"""What a report is made of, gathered before anything is drawn."""
