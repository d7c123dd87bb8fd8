"""What happens between the branches when the force turns round: linear blend, or Maxwell slip stops and their fit."""
