"""The tabs of the page: one module each with `routes(context)`, found by the server; their scripts are in static/tabs."""
