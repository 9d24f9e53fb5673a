"""Tables of points: CSV and Parquet files, read whole, in batches or in parts."""
