"""What commands write and print: tables, summaries, figures, the data of reports."""
