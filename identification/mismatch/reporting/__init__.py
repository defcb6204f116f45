"""The verdict, the memo, the figures and the improved file."""
