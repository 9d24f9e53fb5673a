"""What commands read: points, block sizes, drill-holes, grades, options."""
