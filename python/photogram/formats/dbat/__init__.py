"""PhotoModeler and DBAT: export files, scripts and tables."""
