"""Reports for people: self-contained HTML with inline SVG, made without a template engine, readable offline and in print."""
