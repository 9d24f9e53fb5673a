"""Tables of points: CSV and Parquet, whole, in parts and larger than memory."""
