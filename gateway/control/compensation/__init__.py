"""What control takes back of the defects that a diagnosis has found."""
