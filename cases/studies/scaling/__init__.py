"""What a step would take on many ranks, predicted from messages of this machine."""
