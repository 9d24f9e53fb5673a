"""Commands on several domains of one model: --by COLUMN, and maps that hold several domains."""
