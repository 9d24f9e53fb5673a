"""What commands write and print: result tables, figures, reports."""
