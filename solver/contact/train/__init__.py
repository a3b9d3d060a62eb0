"""The train's side of the contacts: pantographs, their strips and where these are."""
