"""Pages and pictures of results: what reports and figures are made of."""
