"""What a campaign has shown, with how sure one can be of it, as a page that needs nothing else."""
